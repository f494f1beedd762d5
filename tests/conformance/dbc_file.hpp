// SPDX-License-Identifier: Apache-2.0
// A table of CAN messages against the DBC file that it was written from.
#pragma once
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <regex>
#include <string>

#include "hal/can/codec.hpp"

namespace takt::test {

/// A file of ../shared/reference; says visibly where it is absent.
inline std::optional<std::filesystem::path> reference(const std::string& relative) {
  const auto path = std::filesystem::path(TAKT_SOURCE_DIR) / "../shared/reference" / relative;
  if (std::filesystem::exists(path)) return path;
  std::cerr << "NOT RUN: reference " << path << " is absent\n";
  return std::nullopt;
}

inline void check_table(std::span<const can::Message> table, const std::filesystem::path& dbc) {
  std::ifstream file(dbc);
  REQUIRE(file.good());
  static const std::regex message_row(R"(BO_ (\d+) (\w+): (\d+) (\w+))");
  static const std::regex signal_row(
      R"( SG_ (\w+) ?(M|m\d+)? ?: (\d+)\|(\d+)@1([+-]) \(([^,]+),([^)]+)\) \[([^|]+)\|([^\]]+)\].*)");
  static const std::regex data_id_row(R"re(BA_ "E2EDataID" BO_ (\d+) (\d+);)re");
  const can::Message* message = nullptr;
  size_t messages = 0, signal = 0;
  std::string line;
  std::smatch m;
  while (std::getline(file, line)) {
    if (std::regex_match(line, m, message_row)) {
      if (message != nullptr) CHECK(signal == message->signals.size());
      REQUIRE(messages < table.size());
      message = nullptr;
      for (const can::Message& row : table) {
        if (row.name == m[2].str()) message = &row;
      }
      REQUIRE_MESSAGE(message != nullptr, line);
      CHECK(message->id == std::stoul(m[1]));
      CHECK(message->length == std::stoul(m[3]));
      CHECK((message->sender == can::Sender::host) == (m[4] == "HAL_HOST"));
      ++messages;
      signal = 0;
    } else if (std::regex_match(line, m, signal_row)) {
      const std::string name = m[1];
      if (name == "E2E_CRC") CHECK(message->is_protected);
      if (name.starts_with("E2E_") || name.find("Reserved") != std::string::npos) continue;
      REQUIRE_MESSAGE(signal < message->signals.size(), line);
      const can::Signal& row = message->signals[signal++];
      CHECK(row.name == name);
      CHECK(row.page == (m[2] == "M"  ? can::kPageNumber
                         : m[2] == "" ? can::kEveryPage
                                      : std::stoi(m[2].str().substr(1))));
      CHECK(row.start == std::stoul(m[3]));
      CHECK(row.bits == std::stoul(m[4]));
      CHECK(row.is_signed == (m[5] == "-"));
      CHECK(row.factor == std::stod(m[6]));
      CHECK(row.offset == std::stod(m[7]));
      CHECK(row.low == std::stod(m[8]));
      CHECK(row.high == std::stod(m[9]));
    } else if (std::regex_match(line, m, data_id_row)) {
      for (const can::Message& row : table) {
        if (row.id == std::stoul(m[1])) CHECK(row.data_id() == std::stoul(m[2]));
      }
    }
  }
  CHECK(messages == table.size());
}

}  // namespace takt::test
