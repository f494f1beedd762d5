// SPDX-License-Identifier: Apache-2.0
// Clocks that are compared, numbers that are counted, bytes that are read: whatever a network makes of them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <set>
#include <vector>

#include "graph/machines/arrivals.hpp"
#include "graph/machines/clock_pair.hpp"
#include "graph/machines/peer.hpp"

using namespace takt;
using namespace takt::machines;

TEST_CASE("The true offset lies within the error, whatever the ways take and the clocks drift") {
  std::mt19937_64 chance(7);
  const auto up_to = [&](int64_t most) { return static_cast<int64_t>(chance() % static_cast<uint64_t>(most)); };
  for (const double drift_ppm : {0.0, 100.0, -100.0}) {
    ClockPair pair;
    const int64_t first_offset = 5'000'000'000 + up_to(1'000'000'000);
    const auto there = [&](int64_t here) {
      return here + first_offset + static_cast<int64_t>(static_cast<double>(here) * drift_ppm * 1e-6);
    };
    int64_t worst = 0;
    for (int64_t now = 1'000'000'000; now < 600'000'000'000; now += 100'000'000 + up_to(50'000'000)) {
      const int64_t arrives = now + 50'000 + up_to(up_to(10) == 0 ? 30'000'000 : 300'000);
      const int64_t leaves = arrives + up_to(2'000'000);
      const int64_t back = leaves + 50'000 + up_to(300'000);
      if (up_to(20) != 0) pair.add({now, there(arrives), there(leaves), back});
      const auto told = pair.offset(back + 1'000'000);
      if (!told) continue;
      const int64_t off = std::abs(told->offset_ns - (there(back + 1'000'000) - (back + 1'000'000)));
      CHECK(off <= told->error_ns);
      worst = std::max(worst, told->error_ns);
    }
    CHECK(pair.jumps() == 0);
    CHECK(worst < 16'000'000);
  }
}

TEST_CASE("A step of a clock is noticed with the next exchange, and the time before it is forgotten") {
  ClockPair pair;
  int64_t step = 0;
  const auto exchange = [&](int64_t now) {
    pair.add({now, now + step + 100'000, now + step + 100'000, now + 200'000});
  };
  CHECK(!pair.offset(0));
  for (int64_t now = 0; now < 3'000'000'000; now += 100'000'000) exchange(now);
  CHECK(std::abs(pair.offset(3'000'000'000)->offset_ns) <= 200'000);
  step = 1'000'000'000;
  exchange(3'000'000'000);
  CHECK(pair.jumps() == 1);
  CHECK(std::abs(pair.offset(3'000'000'000)->offset_ns - step) <= 200'000);
  pair.add({10, 20, 5, 8});  // back before it was sent
  CHECK(pair.jumps() == 1);
}

TEST_CASE(
    "Whatever is lost, doubled and reordered: each message is taken once, and the missing ones are counted exactly") {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    std::mt19937_64 chance(seed);
    std::vector<std::pair<double, uint64_t>> arriving;
    std::set<uint64_t> lost;
    const uint64_t first = chance() % 1000 + 1, last = first + 2000;
    for (uint64_t sequence = first; sequence <= last; ++sequence) {
      if (sequence != first && sequence != last && chance() % 10 == 0) {
        lost.insert(sequence);
        continue;
      }
      const double at =
          static_cast<double>(sequence) + (sequence == first ? 0 : static_cast<double>(chance() % 100) / 10.0);
      arriving.emplace_back(at, sequence);
      if (chance() % 20 == 0) arriving.emplace_back(at + static_cast<double>(chance() % 30), sequence);
    }
    std::sort(arriving.begin() + 1, arriving.end());
    Arrivals arrivals;
    std::set<uint64_t> taken;
    uint64_t newest = 0, doubled = 0;
    for (const auto& [at, sequence] : arriving) {
      const auto verdict = arrivals.take(sequence);
      if (verdict == Arrivals::doubled) ++doubled;
      else CHECK(taken.insert(sequence).second);
      CHECK((verdict == Arrivals::fresh) == (sequence > newest));
      newest = std::max(newest, sequence);
    }
    CHECK(arrivals.missing() == lost.size());
    CHECK(arrivals.received() == taken.size());
    CHECK(arrivals.doubles() == doubled);
  }
}

TEST_CASE("What has one stamp there has one here, whatever was learnt of the clock meanwhile") {
  Stamps stamps;
  const int64_t first = stamps.here(1'000, 100);
  CHECK(first == 900);
  CHECK(stamps.here(2'000, 103) == 1'897);
  CHECK(stamps.here(1'000, 103) == first);
  stamps.forget();
  CHECK(stamps.here(1'000, 103) == 897);
  for (int64_t i = 0; i < 1000; ++i) CHECK(stamps.here(10'000 + i, 0) == 10'000 + i);
}

TEST_CASE("A state is read as it was written; what is none is told, not thrown") {
  State state{"vision", 81, "a1b2", 5, {}, {}, {}};
  state.facts["stereo.disparity"] = {640, 480, 1, 0};
  state.heard["robot"] = {7, 3, 4};
  const auto again = state_of(text_of(state));
  REQUIRE(again);
  CHECK(text_of(*again) == text_of(state));
  CHECK(again->facts.at("stereo.disparity").height == 480);
  CHECK(again->heard.at("robot").received_ns == 4);
  std::mt19937 chance(1);
  const std::string whole = text_of(state);
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = whole;
    for (int n = 0; n < 1 + i % 3; ++n) damaged[chance() % damaged.size()] = static_cast<char>(chance());
    static_cast<void>(state_of(damaged.substr(0, chance() % (damaged.size() + 1))));
  }
  for (const char* none : {"", "{}", "[]", R"({"takt": 1})", R"({"takt": 2, "machine": "vision"})", "\xff"})
    CHECK(!state_of(none));
}
