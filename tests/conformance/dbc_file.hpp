// SPDX-License-Identifier: Apache-2.0
// A table of CAN messages against the DBC file that it was written from.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hal/can/codec.hpp"

namespace takt::test {

/// Takes a line apart from its front.
class LineParts {
 public:
  explicit LineParts(std::string_view line) : rest_(line) {}
  bool skip(std::string_view text) {
    if (!rest_.starts_with(text)) return false;
    rest_.remove_prefix(text.size());
    return true;
  }
  /// What is up to the first character that is not one of these.
  bool take(std::string& part, std::string_view characters) {
    return take_to(part, rest_.find_first_not_of(characters));
  }
  bool take_until(std::string& part, char end) { return take_to(part, rest_.find(end)) && skip({&end, 1}); }
  std::string_view rest() const { return rest_; }

  static constexpr std::string_view kDigits = "0123456789",
                                    kWord = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

 private:
  bool take_to(std::string& part, size_t end) {
    part = rest_.substr(0, end);
    rest_.remove_prefix(part.size());
    return !part.empty();
  }
  std::string_view rest_;
};

struct MessageRow {
  std::string id, name, length, sender;
};

/// BO_ ID NAME: LENGTH SENDER
inline std::optional<MessageRow> message_row(std::string_view line) {
  MessageRow row;
  LineParts in(line);
  const bool whole = in.skip("BO_ ") && in.take(row.id, in.kDigits) && in.skip(" ") && in.take(row.name, in.kWord) &&
                     in.skip(": ") && in.take(row.length, in.kDigits) && in.skip(" ") &&
                     in.take(row.sender, in.kWord) && in.rest().empty();
  return whole ? std::optional(row) : std::nullopt;
}

struct SignalRow {
  std::string name, page, start, bits, sign, factor, offset, low, high;
};

///  SG_ NAME PAGE : START|BITS@1SIGN (FACTOR,OFFSET) [LOW|HIGH] ...; PAGE: nothing, M or mNUMBER
inline std::optional<SignalRow> signal_row(std::string_view line) {
  SignalRow row;
  LineParts in(line);
  if (!in.skip(" SG_ ") || !in.take(row.name, in.kWord)) return std::nullopt;
  in.skip(" ");
  if (in.skip("M")) {
    row.page = "M";
  } else if (in.skip("m")) {
    if (!in.take(row.page, in.kDigits)) return std::nullopt;
    row.page.insert(0, "m");
  }
  in.skip(" ");
  const bool whole = in.skip(": ") && in.take(row.start, in.kDigits) && in.skip("|") && in.take(row.bits, in.kDigits) &&
                     in.skip("@1") && in.take(row.sign, "+-") && row.sign.size() == 1 && in.skip(" (") &&
                     in.take_until(row.factor, ',') && in.take_until(row.offset, ')') && in.skip(" [") &&
                     in.take_until(row.low, '|') && in.take_until(row.high, ']');
  return whole && in.rest().find('\r') == line.npos ? std::optional(row) : std::nullopt;
}

struct DataIdRow {
  std::string message, data_id;
};

/// BA_ "E2EDataID" BO_ MESSAGE DATA_ID;
inline std::optional<DataIdRow> data_id_row(std::string_view line) {
  DataIdRow row;
  LineParts in(line);
  const bool whole = in.skip("BA_ \"E2EDataID\" BO_ ") && in.take(row.message, in.kDigits) && in.skip(" ") &&
                     in.take(row.data_id, in.kDigits) && in.skip(";") && in.rest().empty();
  return whole ? std::optional(row) : std::nullopt;
}

inline void check_table(std::span<const can::Message> table, const std::filesystem::path& dbc) {
  std::ifstream file(dbc);
  REQUIRE(file.good());
  const can::Message* message = nullptr;
  size_t messages = 0, signal = 0;
  std::string line;
  while (std::getline(file, line)) {
    if (const auto head = message_row(line)) {
      if (message != nullptr) CHECK(signal == message->signals.size());
      REQUIRE(messages < table.size());
      message = nullptr;
      for (const can::Message& row : table) {
        if (row.name == head->name) message = &row;
      }
      REQUIRE_MESSAGE(message != nullptr, line);
      CHECK(message->id == std::stoul(head->id));
      CHECK(message->length == std::stoul(head->length));
      CHECK((message->sender == can::Sender::host) == (head->sender == "HAL_HOST"));
      ++messages;
      signal = 0;
    } else if (const auto said = signal_row(line)) {
      if (said->name == "E2E_CRC") CHECK(message->is_protected);
      if (said->name.starts_with("E2E_") || said->name.find("Reserved") != std::string::npos) continue;
      REQUIRE_MESSAGE(signal < message->signals.size(), line);
      const can::Signal& row = message->signals[signal++];
      CHECK(row.name == said->name);
      CHECK(row.page == (said->page == "M"  ? can::kPageNumber
                         : said->page == "" ? can::kEveryPage
                                            : std::stoi(said->page.substr(1))));
      CHECK(row.start == std::stoul(said->start));
      CHECK(row.bits == std::stoul(said->bits));
      CHECK(row.is_signed == (said->sign == "-"));
      CHECK(row.factor == std::stod(said->factor));
      CHECK(row.offset == std::stod(said->offset));
      CHECK(row.low == std::stod(said->low));
      CHECK(row.high == std::stod(said->high));
    } else if (const auto data = data_id_row(line)) {
      for (const can::Message& row : table) {
        if (row.id == std::stoul(data->message)) CHECK(row.data_id() == std::stoul(data->data_id));
      }
    }
  }
  CHECK(messages == table.size());
}

}  // namespace takt::test
