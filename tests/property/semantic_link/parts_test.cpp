// SPDX-License-Identifier: Apache-2.0
// The parts of the link against their plain definitions, at random.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <set>

#include "hal/semantic_link/assembly.hpp"
#include "hal/semantic_link/clock_map.hpp"
#include "hal/semantic_link/replay_window.hpp"
#include "tests/conformance/link_messages.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::semantic_link;
using takt::test::Bytes;

namespace {

/// 0 .. below - 1.
uint32_t below(std::mt19937& random, uint32_t below) { return static_cast<uint32_t>(random() % below); }

}  // namespace

TEST_CASE("replay window: as a set of all that have come, and the rule for those that are too old") {
  std::mt19937 random(test::seed(3));
  for (int trial = 0; trial < test::rounds(50); ++trial) {
    ReplayWindow window;
    std::set<uint32_t> seen;
    const uint32_t spread = 1 + below(random, 3000);
    uint32_t newest = 0, base = 1;
    for (int i = 0; i < 3000; ++i) {
      base += below(random, 3);
      if (below(random, 500) == 0) base += below(random, 5000);
      const uint32_t back = below(random, spread), sequence = base > back ? base - back : 0;
      const bool too_old = sequence + ReplayWindow::kWidth <= newest;
      const bool expected = sequence > 0 && !seen.contains(sequence) && !too_old;
      REQUIRE(window.take(sequence) == expected);
      if (expected) seen.insert(sequence);
      newest = std::max(newest, expected ? sequence : 0);
      REQUIRE(window.missing() == newest - seen.size());
    }
  }
}

TEST_CASE(
    "clock map: whatever the ways take, the offset lies within its bound; with the shortest ways it is the truth") {
  std::mt19937_64 random(test::seed(5));
  for (int trial = 0; trial < test::rounds(2000); ++trial) {
    ClockMap map;
    const auto draw = [&](int64_t most) { return static_cast<int64_t>(random() % static_cast<uint64_t>(most)); };
    const int64_t ahead = draw(4'000'000'000'000) - 2'000'000'000'000, most_way = 1 + draw(30'000'000);
    int64_t now = 1'000'000'000;
    const int samples = 1 + static_cast<int>(random() % 40);
    for (int i = 0; i < samples; ++i) {
      const int64_t sent = now, heard = sent + draw(most_way), answered = heard + draw(50'000'000);
      now = answered + draw(most_way);
      map.observe(sent, heard + ahead, answered + ahead, now);
      REQUIRE(map.known());
      REQUIRE(std::abs(map.to_own_ns() + ahead) <= map.bound_ns());
      now += draw(50'000'000);
    }
    map.observe(now, now + ahead, now + ahead, now);
    CHECK(map.to_own_ns() == -ahead);
    CHECK(map.bound_ns() == 0);
  }
}

TEST_CASE("clock map: what no clocks can say changes nothing, and no number overflows") {
  ClockMap map;
  map.observe(10, 0, 5, 9);    // came back before it left
  map.observe(10, 5, 0, 20);   // answered before it was heard
  map.observe(10, 0, 50, 20);  // was there longer than it was away
  map.observe(INT64_MIN, 0, 0, INT64_MAX);
  map.observe(0, INT64_MIN, INT64_MAX, 1);
  map.observe(INT64_MAX, INT64_MIN, INT64_MIN, INT64_MAX);
  CHECK_FALSE(map.known());
  CHECK_FALSE(map.own_ns(0));
  map.observe(0, INT64_MAX, INT64_MAX, 10);
  REQUIRE(map.known());
  CHECK_FALSE(map.own_ns(INT64_MIN));  // no clock reaches there
  CHECK(map.own_ns(INT64_MAX) == 5);
}

TEST_CASE("assembly: fragments in any order, again and again, give the message; the newest that is whole wins") {
  std::mt19937 random(test::seed(7));
  constexpr uint32_t kMost = 20'000;
  for (int trial = 0; trial < test::rounds(300); ++trial) {
    Assembly assembly(kMost);
    const size_t unit = 400 + below(random, 1000);
    uint32_t delivered = 0;
    for (uint32_t number = 1; number < 8; ++number) {
      Bytes message(1 + below(random, kMost));
      for (uint8_t& byte : message) byte = static_cast<uint8_t>(random());
      const size_t fragments = fragments_of(message.size(), unit);
      REQUIRE(fragments <= kMostFragments);
      std::vector<size_t> order;
      const bool whole = below(random, 4) != 0;
      for (size_t f = whole ? 0 : 1; f < fragments; ++f) order.insert(order.end(), 1 + below(random, 2), f);
      std::shuffle(order.begin(), order.end(), random);
      bool complete = false;
      for (const size_t f : order) {
        Header header;
        header.kind = Kind::objects;
        header.number = number;
        header.message_bytes = static_cast<uint32_t>(message.size());
        header.fragments = static_cast<uint8_t>(fragments);
        header.fragment = static_cast<uint8_t>(f);
        const auto payload = std::span(message).subspan(f * unit).first(std::min(unit, message.size() - f * unit));
        Bytes bytes(payload.size() + kOverhead);
        write_packet(header, payload, {}, bytes);
        const auto packet = read_packet(bytes, {});
        REQUIRE(packet);
        REQUIRE(unit_of(*packet) == (fragments == 1 ? message.size() : unit));
        if (complete) continue;  // as a session that has it already
        const Assembly::Step step = assembly.add(*packet);
        REQUIRE(step != Assembly::Step::refused);
        complete = step == Assembly::Step::complete;
        if (complete) REQUIRE(std::equal(message.begin(), message.end(), assembly.message().begin()));
      }
      CHECK(complete == (whole && !order.empty()));
      if (complete) delivered = number;
    }
    CHECK(delivered > 0);
  }
}

TEST_CASE("assembly: what is too large, or does not fit what came before of the same number, is refused") {
  Assembly assembly(100);
  const auto add = [&](uint32_t number, uint8_t fragment, uint32_t bytes, size_t unit) {
    Header header;
    header.kind = Kind::scan;
    header.number = number;
    header.message_bytes = bytes;
    header.fragment = fragment;
    header.fragments = static_cast<uint8_t>(fragments_of(bytes, unit));
    Bytes payload(std::min(unit, bytes - fragment * unit)), packet(payload.size() + kOverhead);
    write_packet(header, payload, {}, packet);
    return assembly.add(*read_packet(packet, {}));
  };
  CHECK(add(1, 0, 101, 200) == Assembly::Step::refused);
  CHECK(add(1, 0, 90, 50) == Assembly::Step::incomplete);
  CHECK(add(1, 1, 80, 50) == Assembly::Step::refused);
  CHECK(add(1, 1, 90, 60) == Assembly::Step::refused);
  CHECK(add(2, 1, 90, 50) == Assembly::Step::incomplete);  // a newer one begins
  CHECK(assembly.given_up() == 1);
  CHECK(add(1, 1, 90, 50) == Assembly::Step::incomplete);  // too late
  CHECK(add(2, 0, 90, 50) == Assembly::Step::complete);
}
