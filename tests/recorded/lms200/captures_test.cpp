// SPDX-License-Identifier: Apache-2.0
// Captures of a real LMS 200, and the golden vectors as their collection holds them. Both are beside the project.
#include <doctest/doctest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hal/laser/lms200/commands.hpp"
#include "tests/recorded/recording.hpp"
#include "tests/unit/lms200/telegrams.hpp"

using namespace takt::lms200;
using namespace takt::test;

namespace {

std::vector<uint8_t> bytes_in(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::vector<std::string>> rows_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  REQUIRE(stream);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::istringstream text(line);
    std::vector<std::string> fields;
    for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
    rows.push_back(std::move(fields));
  }
  return rows;
}

/// Payload of each telegram, by its place in the file.
using Found = std::map<uint64_t, std::vector<uint8_t>>;
Found telegrams_in(std::span<const uint8_t> bytes, Parser parser) {
  Found found;
  parse(parser, bytes, [&](const Event& event) {
    if (event.kind == EventKind::telegram) found[event.position] = copy_of(event.payload);
  });
  return found;
}

/// Every row of the index is taken or refused as it is marked; returns what else was found.
Found check_rows(const std::string& session, const char* direction, Found found) {
  size_t taken = 0, refused = 0;
  for (const auto& row : rows_in(recording("sick/lms200/" + session + ".index.csv"))) {
    if (row.size() < 6 || row[1] != direction) continue;
    INFO(session, " ", row[2]);
    const auto telegram = found.find(std::stoull(row[2]));
    const bool whole = telegram != found.end() && telegram->second.size() + kFraming == std::stoull(row[3]);
    CHECK(whole == (row[5] == "ok"));
    if (whole) {
      CHECK(telegram->second[0] == std::stoul(row[4], nullptr, 16));
      found.erase(telegram);
    }
    ++(whole ? taken : refused);
  }
  std::printf("%s %s: %zu rows taken, %zu refused, %zu more found\n", session.c_str(), direction, taken, refused,
              found.size());
  return found;
}

}  // namespace

TEST_CASE("captures of a real scanner: rows as marked, distances as its driver had them") {
  for (const std::string session : {"2017_Aug_04_23-22-04", "2017_Aug_05_18-52-56"}) {
    const auto file = recording("sick/lms200/" + session + ".rx.bin");
    const auto found = telegrams_in(bytes_in(file), Parser::of_replies());
    CHECK(check_rows(session, "rx", found).empty());
    auto rows = rows_in(recording("sick/lms200/" + session + ".distances.csv"));
    auto row = rows.begin();
    while (row != rows.end() && row->size() < 300) ++row;  // a heading
    size_t beams = 0;
    for (const auto& [position, payload] : found) {
      const auto scan = read_scan(payload);
      if (!scan) continue;
      REQUIRE(row != rows.end());
      REQUIRE(row->size() == 1 + scan->beams());
      for (size_t i = 0; i < scan->beams(); ++i, ++beams) {
        const double driver_m = std::stod((*row)[1 + i]);
        const Beam beam = read_beam(scan->word(i), *distance_bits(0x04));
        // That driver took special values for distances.
        const int millimetres = beam.echo == Echo::valid ? beam.distance : scan->word(i) & no_echo(14);
        CHECK(std::abs(driver_m - 0.001 * millimetres) <= 0.0005);
      }
      ++row;
    }
    CHECK(row == rows.end());
    std::printf("%s: %zu distances equal\n", session.c_str(), beams);
  }
}

TEST_CASE("what was said to a real scanner") {
  for (const std::string session : {"2017_Aug_04_23-22-04", "2017_Jul_03_14-29-30"}) {
    const auto file = recording("sick/lms200/" + session + ".tx.bin");
    const auto found = telegrams_in(bytes_in(file), Parser::of_commands());
    CHECK(check_rows(session, "tx", found).empty());
    for (const auto& [position, payload] : found)
      CHECK(copy_of(Telegram(0, payload).bytes()).size() == payload.size() + kFraming);
  }
}

TEST_CASE("a corrupted link: a whole telegram inside a broken one is found, the broken ones are not") {
  const auto file = recording("sick/lms200/2017_Aug_05_19-09-36.rx.bin");
  const auto bytes = bytes_in(file);
  const auto inside = check_rows("2017_Aug_05_19-09-36", "rx", telegrams_in(bytes, Parser::of_replies()));
  REQUIRE(inside.size() == 1);
  CHECK(inside.begin()->first == 60);  // in the row that begins at 47
  CHECK(read_text(inside.begin()->second) == "LMS200;S18063;V02.19 ");
  CHECK(events_in(bytes) == std::vector<std::string>{"CRC error", "B2", "A0 ok", "CRC error", "BA"});
}

TEST_CASE("the whole collection of golden vectors, bit by bit") {
  for (const char* name : {"lms200_telegrams.json", "lms200_recorded.json"}) {
    const auto file = reference(std::string("golden/") + name);
    std::ifstream stream(file);
    const auto all = nlohmann::json::parse(stream);
    size_t telegrams = 0, checked_streams = 0;
    const auto check = [&](const nlohmann::json& entry) {
      const auto bytes = bytes_of_hex(entry["hex"].get<std::string>());
      INFO(entry["id"].get<std::string>());
      const auto found = telegrams_in(bytes, bytes[1] == 0 ? Parser::of_commands() : Parser::of_replies());
      REQUIRE(found.size() == 1);
      CHECK(copy_of(Telegram(bytes[1], found.begin()->second).bytes()) == bytes);
      if (const auto scan = read_scan(found.begin()->second)) CHECK(copy_of(scan_telegram(*scan).bytes()) == bytes);
      ++telegrams;
    };
    for (const auto& entry : all["telegrams"]) check(entry);
    if (all.contains("scans"))
      for (const auto& entry : all["scans"]) check(entry);
    if (all.contains("streams"))
      for (const auto& entry : all["streams"]) {
        INFO(entry["id"].get<std::string>());
        const auto bytes = bytes_of_hex(entry["hex"].get<std::string>());
        CHECK(events_in(bytes) == entry["expect"].get<std::vector<std::string>>());
        CHECK(events_in(bytes, 1) == entry["expect"].get<std::vector<std::string>>());
        ++checked_streams;
      }
    std::printf("%s: %zu telegrams both ways, %zu streams\n", name, telegrams, checked_streams);
  }
}
