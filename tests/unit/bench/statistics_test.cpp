// SPDX-License-Identifier: Apache-2.0
#include "bench/statistics.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

using namespace takt::bench;

TEST_CASE("a quantile is the smallest sample that this fraction of all does not exceed") {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    Samples samples;
    const int count = std::uniform_int_distribution<int>(1, 40)(random);
    for (int i = 0; i < count; ++i) samples.add(std::uniform_int_distribution<int>(0, 9)(random));
    for (double fraction : {0.0, 0.01, 0.5, 0.99, 0.999, 1.0}) {
      std::vector<double> sorted = samples.values();
      std::sort(sorted.begin(), sorted.end());
      // The definition, tried on one sample after the other.
      const auto enough = [&](double value) {
        const auto below = std::count_if(sorted.begin(), sorted.end(), [&](double v) { return v <= value; });
        return static_cast<double>(below) >= fraction * static_cast<double>(sorted.size());
      };
      CHECK(samples.quantile(fraction) == *std::find_if(sorted.begin(), sorted.end(), enough));
    }
    CHECK(samples.max() == samples.quantile(1));
  }
  CHECK_FALSE(Samples().quantile(0.5));
  CHECK_FALSE(Samples().max());
}

TEST_CASE("the median of an even number lies between the middle two") {
  CHECK(median({3, 1, 2}) == 2);
  CHECK(median({4, 1, 3, 2}) == 2.5);
  CHECK(median({}) == 0);
}

TEST_CASE("A B A B A: each B stands against the mean of its neighbours, and a drift of the machine cancels") {
  Pairs pairs;
  // The machine slows down steadily; B always takes twice as long as A would at that moment.
  for (int i = 0; i < 9; ++i) (i % 2 == 0) ? pairs.add_a(100 + i) : pairs.add_b(2 * (100 + i));
  REQUIRE(pairs.middle());
  CHECK(pairs.middle()->ratio == doctest::Approx(2));
  CHECK(pairs.middle()->value == doctest::Approx(2 * pairs.middle()->reference));
  REQUIRE(pairs.null());
  CHECK(pairs.null()->ratio == doctest::Approx(1));
}

TEST_CASE("as many A as B: each B stands against its own round's A, and there is no null pair to be had") {
  Pairs pairs;
  for (double ratio : {5.0, 1.5, 1.0}) {
    pairs.add_a(10);
    pairs.add_b(10 * ratio);
  }
  REQUIRE(pairs.middle());
  CHECK(pairs.middle()->ratio == doctest::Approx(1.5));
  CHECK(pairs.middle()->value == doctest::Approx(15));
  CHECK_FALSE(pairs.null());
}

TEST_CASE("a reference of zero makes no ratio") {
  Pairs pairs;
  pairs.add_a(0);
  pairs.add_b(1);
  CHECK_FALSE(pairs.middle());
}
