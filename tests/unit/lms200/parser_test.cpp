// SPDX-License-Identifier: Apache-2.0
// What the parser finds in streams that are cut, joined, damaged, or no telegrams at all.
#include <doctest/doctest.h>

#include "hal/laser/lms200/commands.hpp"
#include "tests/unit/lms200/telegrams.hpp"

using namespace takt::lms200;
using namespace takt::test;
using Texts = std::vector<std::string>;

namespace {

const std::vector<uint8_t> kAckByte{kAck}, kNakByte{kNak};

std::vector<uint8_t> first_of(std::vector<uint8_t> bytes, size_t count) {
  bytes.resize(count);
  return bytes;
}

/// The seven golden streams, and what must be found in each.
struct Stream {
  const char* name;
  std::vector<uint8_t> bytes;
  Texts events;
};
std::vector<Stream> streams() {
  const auto scan = golden_scan("scan_1deg_181"), half = golden_scan("scan_0p5deg_361"), ok = golden("rsp_mode_ok");
  auto broken = scan;
  broken[200] ^= 0x10;
  return {
      {"start", kAckByte + ok + scan + scan, {"ACK", "A0 ok", "B0 181", "B0 181"}},
      {"nak", kNakByte, {"NAK"}},
      {"garbage before", std::vector<uint8_t>{0xFF, 0x02, 0x00, 0x80, 0x02} + scan, {"B0 181"}},
      {"cut telegram", first_of(scan, 100) + scan, {"CRC error", "B0 181"}},
      {"bad CRC", broken + half, {"CRC error", "B0 361"}},
      {"absurd length", std::vector<uint8_t>{0x02, 0x80, 0xFF, 0xFF, 0xB0} + scan, {"length error", "B0 181"}},
      {"stale scan before ACK", half + kAckByte + ok, {"B0 361", "ACK", "A0 ok"}},
  };
}

}  // namespace

TEST_CASE("streams give the same events however they are cut") {
  for (const Stream& stream : streams()) {
    INFO(stream.name);
    CHECK(events_in(stream.bytes) == stream.events);
    for (const size_t piece : {1, 2, 3, 7, 64, 371}) CHECK(events_in(stream.bytes, piece) == stream.events);
  }
}

TEST_CASE("a telegram inside the length that a broken one claims is found") {
  const auto half = golden_scan("scan_0p5deg_361"), type = golden("rec_ba_1");
  const auto stream = first_of(half, 15) + type + first_of(half, 688) + golden("rsp_mode_ok") + half;
  CHECK(events_in(stream) == Texts{"CRC error", "BA", "CRC error", "A0 ok", "B0 361"});
}

TEST_CASE("no single flipped bit makes another telegram of a telegram") {
  for (const char* name : {"rsp_mode_ok", "rsp_type", "rsp_config", "rec_b1_5"}) {
    const auto whole = golden(name);
    for (size_t bit = 8; bit < 8 * whole.size(); ++bit) {  // the first byte may become an ACK
      auto flipped = whole;
      flipped[bit / 8] = static_cast<uint8_t>(flipped[bit / 8] ^ 1u << bit % 8);
      for (const std::string& event : events_in(flipped)) CHECK((event == "CRC error" || event == "length error"));
    }
  }
}

TEST_CASE("what a telegram of another address, or to another side, is not") {
  const auto reply = golden("rsp_mode_ok");
  Parser commands = Parser::of_commands();
  parse(commands, reply, [](const Event&) { FAIL("a reply is no command"); });
  Parser other = Parser::of_replies(5);
  parse(other, reply, [](const Event&) { FAIL("the reply of LMS 0 is none of LMS 5"); });
  const Telegram to_five(5 + kFromLms, std::vector<uint8_t>{0xA0, 0, 0x10});
  int found = 0;
  parse(other, to_five.bytes(), [&](const Event& event) { found += event.kind == EventKind::telegram; });
  CHECK(found == 1);
}

TEST_CASE("positions count every byte, and what has begun can be given up") {
  const auto ok = golden("rsp_mode_ok");
  const auto stream = std::vector<uint8_t>{0x55, 0x55} + first_of(golden("rsp_type"), 12);
  Parser parser = Parser::of_replies();
  parse(parser, stream, [](const Event&) { FAIL("nothing is whole yet"); });
  CHECK(parser.begun());
  parser.abandon();
  uint64_t position = 0;
  parse(parser, ok, [&](const Event& event) {
    CHECK(event.kind == EventKind::telegram);
    position = event.position;
  });
  CHECK(position == stream.size());
  CHECK_FALSE(parser.begun());
  parse(parser, first_of(ok, 5), [](const Event&) {});
  parser.reset();
  parse(parser, ok, [&](const Event& event) { position = event.position; });
  CHECK(position == stream.size() + ok.size() + 5);
}

TEST_CASE("more bytes at once than the parser holds") {
  std::vector<uint8_t> stream;
  for (int i = 0; i < 40; ++i) stream = stream + golden_scan("scan_0p25deg_401") + std::vector<uint8_t>(97, 0x02);
  const auto events = events_in(stream);
  CHECK(std::count(events.begin(), events.end(), "B0 401") == 40);
}
