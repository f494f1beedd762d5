// SPDX-License-Identifier: Apache-2.0
// Pace and rates of a line, and when its bytes came.
#include <doctest/doctest.h>

#include <algorithm>

#include "hal/stream/byte_clock.hpp"
#include "hal/stream/byte_window.hpp"
#include "hal/stream/paced_line.hpp"
#include "tests/conformance/laser_line.hpp"
#include "tests/hex.hpp"

using namespace takt;
using namespace takt::test;

namespace {

/// A line with 10 bit times a byte, sample by sample: what received_at_other_rate() does, slowly and plainly.
std::vector<uint8_t> sampled(const std::vector<uint8_t>& bytes, uint32_t from, uint32_t to) {
  std::vector<bool> line;  // a level for each of from * to parts of a second
  for (const uint8_t byte : bytes)
    for (int bit = 0; bit < 10; ++bit)
      line.insert(line.end(), to, bit == 9 || (bit > 0 && (byte >> (bit - 1) & 1) != 0));
  const auto at = [&](size_t part) { return part >= line.size() || line[part]; };
  std::vector<uint8_t> received;
  for (size_t part = 0; part < line.size();) {
    if (at(part)) {
      ++part;
      continue;
    }
    uint8_t byte = 0;
    for (size_t bit = 1; bit <= 8; ++bit)
      if (at(part + from / 2 + bit * from)) byte = static_cast<uint8_t>(byte | 1u << (bit - 1));
    received.push_back(at(part + from / 2 + 9 * from) ? byte : uint8_t{0});
    for (part += from / 2 + 9 * from; !at(part);) ++part;
  }
  return received;
}

uint32_t next(uint32_t& random) { return (random = random * 1664525 + 1013904223) >> 16; }

}  // namespace

TEST_CASE("at its own rate a receiver gets every byte, at another what its samples say") {
  std::vector<uint8_t> all;
  for (int byte = 0; byte < 256; ++byte) all.push_back(static_cast<uint8_t>(byte));
  CHECK(received_at_other_rate(all, 38400, 38400) == all);
  CHECK(received_at_other_rate(all, 100, 101) == all);  // 1 %: within what start bits make good
  uint32_t random = 7;
  for (const auto& [from, to] : {std::pair{24u, 6u}, std::pair{6u, 24u}, std::pair{12u, 24u}, std::pair{50u, 4u}}) {
    for (int round = 0; round < 20; ++round) {
      std::vector<uint8_t> bytes(1 + next(random) % 40);
      for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(next(random));
      const auto received = received_at_other_rate(bytes, from, to);
      CHECK(received == sampled(bytes, from, to));
      CHECK(received != bytes);
    }
  }
}

TEST_CASE("bytes leave at the device's pace, one telegram after the other") {
  LineState state;
  MemoryDeviceEnd far(state);
  REQUIRE(far.open().has_value());
  PacedLine line(far);
  line.set_baud(9600);
  state.baud = 9600;
  const std::vector<uint8_t> ten(10, 0x55), three(3, 0x66);
  const int64_t byte_ns = byte_time_ns(9600);
  CHECK(byte_ns == 1'041'666);
  line.send(5'000'000, ten);
  line.send(6'000'000, three);
  CHECK(line.free_ns() == 5'000'000 + 13 * byte_ns);
  line.run_to(5'000'000 + byte_ns - 1);
  CHECK(state.host_bytes.empty());
  line.run_to(5'000'000 + byte_ns);
  CHECK(state.host_bytes.size() == 1);
  line.run_to(5'000'000 + 10 * byte_ns);
  CHECK(state.host_bytes.size() == 10);
  line.run_to(5'000'000 + 11 * byte_ns);
  CHECK(state.host_bytes.back() == 0x66);
  line.interrupt(5'000'000 + 12 * byte_ns);
  line.run_to(1'000'000'000);
  CHECK(state.host_bytes.size() == 12);
  line.send(2'000'000'000, three);
  CHECK(line.free_ns() == 2'000'000'000 + 3 * byte_ns);
  line.set_baud(0);
  line.run_to(2'000'000'000);
  CHECK(state.host_bytes.size() == 15);
}

TEST_CASE("the time of a byte is known however late and in whatever pieces it is read") {
  uint32_t random = 3;
  for (int round = 0; round < 200; ++round) {
    const uint32_t baud = round % 2 == 0 ? 38400 : 500000;
    ByteClock clock;
    clock.set_baud(baud);
    const int64_t byte_ns = byte_time_ns(baud);
    // Bytes end at 1, 2, 3 ... byte times; pieces are read late, one of them at once.
    const uint64_t prompt = next(random) % 10;
    uint64_t read = 0;
    for (uint64_t piece = 0; piece < 10; ++piece) {
      read += 1 + next(random) % 40;
      const int64_t late_ns = piece == prompt ? 0 : next(random) * 100;
      clock.add(read, static_cast<int64_t>(read) * byte_ns + late_ns);
    }
    CHECK(clock.arrival_ns(0) == byte_ns);
    CHECK(clock.arrival_ns(read - 1) >= static_cast<int64_t>(read) * byte_ns);
  }
}

TEST_CASE("periodic instants are found behind sightings that are up to 16 ms late") {
  uint32_t random = 5;
  for (const double slow : {1.0, 1.0014, 0.9986}) {  // than the period says; 1.0014 is what was recorded
    constexpr int64_t kPeriod = 26'640'000;
    PeriodicInstants instants(kPeriod);
    double worst_ms = 0;
    for (int k = 0; k < 4000; ++k) {
      if (k > 1000 && k < 1050) continue;  // none for a while
      const auto true_ns = static_cast<int64_t>(1e9 + slow * static_cast<double>(kPeriod) * k);
      const int64_t refined = instants.refine(true_ns + next(random) * 16'000'000ll / 65536);
      if (k > 100) worst_ms = std::max(worst_ms, static_cast<double>(std::abs(refined - true_ns)) * 1e-6);
      if (k > 0 && k != 1050) CHECK(instants.periods() == 1);
      if (k == 1050) CHECK(instants.periods() == 50);
    }
    CHECK(worst_ms < 8);
    MESSAGE("period off by ", slow, ": at most ", worst_ms, " ms beside the truth");
  }
}

TEST_CASE("periods that late sightings count too many are taken back when one comes in time") {
  uint32_t random = 3;
  constexpr int64_t kPeriod = 26'640'000;
  PeriodicInstants instants(kPeriod);
  int64_t counted = 0, truth = 0, wrong = 0, last_seen_ns = 0;
  for (int k = 0; k < 20'000; ++k, ++truth) {
    if (next(random) % 50 == 0) truth += next(random) % 4;  // some are not there
    const bool in_time = next(random) % 100 > 0;
    const int64_t late_ns = in_time ? 0 : next(random) * 3 * kPeriod / 65536;
    const int64_t seen_ns = std::max(last_seen_ns + kPeriod / 2, truth * kPeriod + late_ns);  // in their order
    instants.refine(last_seen_ns = seen_ns);
    counted += k > 0 ? instants.periods() : 0;
    wrong += counted != truth ? 1 : 0;
    if (seen_ns - truth * kPeriod < kPeriod / 4) CHECK(counted == truth);
  }
  CHECK(wrong > 0);
}

TEST_CASE("a window holds what was pushed, in one piece") {
  ByteWindow<64> window;
  uint32_t random = 9;
  std::vector<uint8_t> model;
  uint64_t dropped = 0;
  for (int round = 0; round < 5000; ++round) {
    std::vector<uint8_t> bytes(next(random) % 50);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(next(random));
    const size_t taken = window.push(bytes);
    CHECK(taken == std::min(bytes.size(), 64 - model.size()));
    model.insert(model.end(), bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(taken));
    const size_t drop = model.empty() ? 0 : next(random) % (model.size() + 1);
    window.drop(drop);
    model.erase(model.begin(), model.begin() + static_cast<ptrdiff_t>(drop));
    dropped += drop;
    CHECK(copy_of(window.bytes()) == model);
    CHECK(window.position() == dropped);
  }
}
