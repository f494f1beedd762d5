// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/laser/lms200/commands.hpp"
#include "hal/laser/lms200/scan.hpp"
#include "hal/settings/json.hpp"
#include "rt/file/input_file.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// A telegram that was received, as the index of a capture lists it.
struct Row {
  uint64_t offset = 0, length = 0;
  bool good = false;
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream text(line);
  for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
  return fields;
}

std::ifstream open_file(const std::filesystem::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  return stream;
}

/// Rows time,rx,offset,length,command,ok|BAD; those with tx are of another file.
std::map<uint64_t, Row> read_index(const std::filesystem::path& file) {
  std::ifstream stream = open_file(file);
  std::map<uint64_t, Row> rows;
  std::string line;
  for (size_t number = 1; std::getline(stream, line); ++number) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    const auto fields = fields_of(line);
    if (number == 1 || fields.size() < 2 || fields[1] != "rx") continue;
    try {
      const Row row{std::stoull(fields.at(2)), std::stoull(fields.at(3)), fields.at(5) == "ok"};
      rows[row.offset] = row;
    } catch (const std::exception&) {
      throw std::runtime_error(
          fmt::format("{}:{}: is no row time,rx,offset,length,command,ok|BAD", file.string(), number));
    }
  }
  return rows;
}

struct Outcome {
  size_t accepted = 0, rejected = 0;  ///< rows
  size_t wrong = 0;                   ///< rows that were not taken as the index marks them
  std::vector<std::string> inside;    ///< whole telegrams inside rejected rows
  size_t unlisted = 0;                ///< accepted where the index lists nothing and nothing was rejected
  size_t crc_errors = 0, length_errors = 0;
  uint64_t unfinished_bytes = 0;             ///< at the end: begun, but not whole
  std::vector<std::vector<uint16_t>> scans;  ///< distances as they stand in the words, flags taken off
};

/// Distances as the driver that recorded them took them: 14 bits, special values and all.
std::vector<uint16_t> distances_of(const lms200::Scan& scan) {
  constexpr uint16_t kDistance = lms200::no_echo(14);
  std::vector<uint16_t> distances;
  for (size_t i = 0; i < scan.beams(); ++i) distances.push_back(scan.word(i) & kDistance);
  return distances;
}

Outcome evaluate_capture(const std::vector<uint8_t>& bytes, const std::map<uint64_t, Row>& rows) {
  Outcome out;
  struct Telegram {
    uint64_t length;
    uint8_t code;
  };
  std::map<uint64_t, Telegram> good;  // by offset
  lms200::Parser parser = lms200::Parser::of_replies();
  lms200::parse(parser, bytes, [&](const lms200::Event& event) {
    out.crc_errors += event.kind == lms200::EventKind::crc_error;
    out.length_errors += event.kind == lms200::EventKind::length_error;
    if (event.kind != lms200::EventKind::telegram) return;
    good[event.position] = {event.payload.size() + lms200::kFraming, event.payload[0]};
    if (const auto scan = lms200::read_scan(event.payload)) out.scans.push_back(distances_of(*scan));
  });
  for (const auto& [offset, row] : rows) {
    const auto found = good.find(offset);
    const bool accepted = found != good.end() && found->second.length == row.length;
    ++(accepted ? out.accepted : out.rejected);
    out.wrong += accepted != row.good;
  }
  uint64_t end = 0;
  for (const auto& [offset, telegram] : good) {
    end = std::max(end, offset + telegram.length);
    auto row = rows.upper_bound(offset);
    if (rows.count(offset) != 0) continue;
    const bool inside = row != rows.begin() && !(--row)->second.good && offset < row->first + row->second.length;
    if (inside)
      out.inside.push_back(
          fmt::format("{:02X}, {} bytes at {}, in the row at {}", telegram.code, telegram.length, offset, row->first));
    else ++out.unlisted;
  }
  if (parser.begun()) out.unfinished_bytes = bytes.size() - end;
  return out;
}

/// Compares with lines time,d0,d1,... in metres.
void compare(const std::filesystem::path& file, const Outcome& out, Json& json) {
  std::ifstream stream = open_file(file);
  std::string line;
  size_t scans = 0, beams = 0, differ = 0;
  double largest_m = 0;
  while (std::getline(stream, line)) {
    const auto fields = fields_of(line);
    if (fields.size() < 2 || fields[1].empty() || fields[1].find_first_not_of("0123456789.-eE \r") != std::string::npos)
      continue;
    if (scans >= out.scans.size()) throw std::runtime_error(file.string() + ": has more scans than the capture");
    const auto& scan = out.scans[scans++];
    if (scan.size() != fields.size() - 1)
      throw std::runtime_error(fmt::format("{}: scan {} has {} values, the capture {}", file.string(), scans,
                                           fields.size() - 1, scan.size()));
    for (size_t i = 0; i < scan.size(); ++i) {
      const double error_m = std::abs(std::stod(fields[i + 1]) - 0.001 * scan[i]);
      largest_m = std::max(largest_m, error_m);
      differ += error_m > 0.0005;
      ++beams;
    }
  }
  json["scans_compared"] = scans;
  json["beams_compared"] = beams;
  json["beams_that_differ"] = differ;
  json["largest_difference_mm"] = 1e3 * largest_m;
}

}  // namespace

int evaluate(const EvalLms200Options& options) {
  std::ifstream stream = open_file(options.rx);
  const std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(stream), {}};
  const Outcome out = evaluate_capture(bytes, read_index(options.index));
  Json json{{"bytes", bytes.size()},
            {"accepted", out.accepted},
            {"rejected", out.rejected},
            {"not_as_marked", out.wrong},
            {"found_inside_rejected", out.inside.size()},
            {"inside", out.inside},
            {"unlisted", out.unlisted},
            {"crc_errors", out.crc_errors},
            {"length_errors", out.length_errors},
            {"unfinished_bytes", out.unfinished_bytes},
            {"scans", out.scans.size()}};
  if (!options.distances.empty()) compare(options.distances, out, json);
  if (options.json) std::printf("%s\n", json.dump(2).c_str());
  else
    for (const auto& [name, value] : json.items()) std::printf("%-22s %s\n", name.c_str(), value.dump().c_str());
  return kOk;
}

}  // namespace takt::command
