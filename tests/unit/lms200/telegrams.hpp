// SPDX-License-Identifier: Apache-2.0
// Bytes of the golden table, and what a parser finds in bytes, as text.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "hal/laser/lms200/scan.hpp"
#include "hal/laser/lms200/telegram.hpp"
#include "tests/hex.hpp"
#include "tests/unit/lms200/golden.hpp"

namespace takt::test {

inline std::vector<uint8_t> golden(std::string_view name) {
  for (const auto& telegram : kLms200Telegrams)
    if (telegram.name == name) return bytes_of_hex(telegram.hex);
  for (const auto& telegram : kLms200ShortScans)
    if (telegram.name == name) return bytes_of_hex(telegram.hex);
  FAIL("no golden telegram " << name);
  return {};
}

/// Built from its rule.
inline std::vector<uint8_t> golden_scan(std::string_view name) {
  for (const GoldenScan& rule : kLms200Scans) {
    if (rule.name != name) continue;
    std::vector<uint8_t> words;
    for (unsigned i = 0; i < rule.beams; ++i) {
      const unsigned grown = rule.step * i, value = rule.first + (rule.modulus != 0 ? grown % rule.modulus : grown);
      words.push_back(static_cast<uint8_t>(value));
      words.push_back(static_cast<uint8_t>(value >> 8));
    }
    lms200::Scan scan;
    scan.millimetres = true;
    scan.partial = (rule.head & 0x2000) != 0;
    scan.quarters = static_cast<uint8_t>(rule.head >> 11 & 3);
    scan.words = words;
    if (rule.indices) scan.indices = {7, 200};
    scan.status = 0x10;
    return copy_of(lms200::scan_telegram(scan).bytes());
  }
  FAIL("no golden scan " << name);
  return {};
}

/// "ACK", "CRC error", "A0 ok", "B0 181".
inline std::string text_of(const lms200::Event& event) {
  using lms200::EventKind;
  switch (event.kind) {
    case EventKind::ack: return "ACK";
    case EventKind::nak: return "NAK";
    case EventKind::crc_error: return "CRC error";
    case EventKind::length_error: return "length error";
    case EventKind::telegram: break;
  }
  char code[8];
  std::snprintf(code, sizeof code, "%02X", event.payload[0]);
  if (const auto scan = lms200::read_scan(event.payload))
    return std::string(code) + " " + std::to_string(scan->beams());
  return code + std::string(event.payload[1] == 0 ? " ok" : "");
}

/// In pieces of that size.
inline std::vector<std::string> events_in(std::span<const uint8_t> bytes, size_t piece = SIZE_MAX) {
  lms200::Parser parser = lms200::Parser::of_replies();
  std::vector<std::string> events;
  while (!bytes.empty()) {
    const auto now = bytes.first(std::min(piece, bytes.size()));
    lms200::parse(parser, now, [&](const lms200::Event& event) { events.push_back(text_of(event)); });
    bytes = bytes.subspan(now.size());
  }
  return events;
}

}  // namespace takt::test
