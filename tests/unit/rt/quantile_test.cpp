// SPDX-License-Identifier: Apache-2.0
#include "rt/quantile.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>

using takt::median, takt::quantile;

TEST_CASE("a quantile has that share of the values below it") {
  std::vector<double> values(1000);
  std::iota(values.begin(), values.end(), 0.0);
  std::shuffle(values.begin(), values.end(), std::mt19937(1));
  for (const double share : {0.0, 0.05, 0.5, 0.95, 0.999})
    CHECK(quantile(values, share) == doctest::Approx(1000 * share));
  CHECK(quantile(values, 1) == 999);  // nothing lies above the largest
}

TEST_CASE("of few values") {
  CHECK(quantile(std::vector<double>{}, 0.5) == 0);
  CHECK(median(std::vector<float>{}) == 0);
  CHECK(median(std::vector<double>{7}) == 7);
  CHECK(median(std::vector<int>{3, 1, 2}) == 2);
  CHECK(median(std::vector<double>{4, 3, 1, 2}) == 3);  // the upper of the two middle ones
  CHECK(quantile(std::vector<double>{4, 3, 1, 2}, 0) == 1);
  CHECK(quantile(std::vector<double>{4, 3, 1, 2}, 1) == 4);
}
