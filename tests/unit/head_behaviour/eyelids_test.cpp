// SPDX-License-Identifier: Apache-2.0
#include "nodes/head_behaviour/eyelids.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "tests/nanoseconds.hpp"

using namespace takt::head_behaviour;
using takt::test::kMs;

TEST_CASE("three saturated images in a row shut the lid for five seconds; then it opens to look again") {
  SunGuard sun;
  int64_t now = 0;
  const auto image = [&](bool saturated) {
    now += 100 * kMs;
    sun.see(saturated, now - 30 * kMs, now);
    return sun.closed(now);
  };
  for (const bool saturated : {true, true, false, true, true}) CHECK_FALSE(image(saturated));
  CHECK(image(true));
  const int64_t shut = now;
  while (image(false)) CHECK(now < shut + 5000 * kMs);  // dark images of a closed lid say nothing
  CHECK(now == shut + 5000 * kMs);
  while (now < shut + 5500 * kMs) CHECK_FALSE(image(true));  // taken while it opens
  CHECK_FALSE(image(true));
  CHECK_FALSE(image(true));
  CHECK(image(true));
  now = shut + 20'000 * kMs;
  for (int k = 0; k < 50; ++k) CHECK_FALSE(image(false));
}

TEST_CASE("an image counts once, however often it is seen") {
  SunGuard sun;
  for (int k = 0; k < 10; ++k) sun.see(true, 5, 10 + k);
  CHECK_FALSE(sun.closed(20));
}

TEST_CASE("blinks while there is a partner: half to one and a half times the interval apart, the same for a seed") {
  const auto blinks = [](uint64_t seed) {
    Blinker blinker({4, 0.5}, seed);
    std::vector<int64_t> begins;
    bool before = false;
    int64_t closed_ms = 0;
    for (int64_t ms = 0; ms < 400'000; ms += 10) {
      const bool closed = blinker.closed(true, ms * kMs);
      if (closed && !before) begins.push_back(ms);
      closed_ms += closed ? 10 : 0;
      before = closed;
    }
    for (size_t i = 1; i < begins.size(); ++i) {
      CHECK(begins[i] - begins[i - 1] >= 2500);
      CHECK(begins[i] - begins[i - 1] <= 6520);
    }
    CHECK(closed_ms == doctest::Approx(500.0 * static_cast<double>(begins.size())).epsilon(0.03));
    return begins;
  };
  const auto begins = blinks(1);
  CHECK(begins.size() > 80);
  CHECK(begins.size() < 97);
  CHECK(blinks(1) == begins);
  CHECK(blinks(2) != begins);
}

TEST_CASE("nobody there: no blink, and the next partner is not met with one") {
  Blinker blinker({1, 0.2}, 1);
  for (int64_t s = 0; s < 100; ++s) CHECK_FALSE(blinker.closed(false, s * 1000 * kMs));
  CHECK_FALSE(blinker.closed(true, 100'000 * kMs));
  CHECK_FALSE(blinker.closed(true, 100'490 * kMs));
}
