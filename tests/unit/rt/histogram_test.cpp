// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/histogram.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

TEST_CASE("quantiles agree with the sorted samples to 1/32") {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> durations(13, 3);
  takt::Histogram histogram;
  std::vector<int64_t> samples;
  for (int i = 0; i < 20000; ++i) {
    samples.push_back(static_cast<int64_t>(durations(random)));
    histogram.add(samples.back());
  }
  std::sort(samples.begin(), samples.end());
  for (const double q : {0.001, 0.25, 0.5, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<size_t>(std::ceil(q * 20000)) - 1;
    const auto exact = static_cast<double>(samples[rank]);
    CHECK(static_cast<double>(histogram.quantile_ns(q)) >= exact);
    CHECK(static_cast<double>(histogram.quantile_ns(q)) <= exact * (1 + 1.0 / 32));
  }
  CHECK(histogram.max_ns() == samples.back());
  CHECK(histogram.sum_ns() == std::accumulate(samples.begin(), samples.end(), int64_t{0}));
  CHECK(histogram.count() == samples.size());
}

TEST_CASE("an empty histogram has no samples and what is beyond its range is the maximum") {
  takt::Histogram histogram;
  CHECK(histogram.count() == 0);
  CHECK(histogram.quantile_ns(0.5) == 0);
  histogram.add(int64_t{1} << 60);
  histogram.add(-5);
  CHECK(histogram.max_ns() == int64_t{1} << 60);
  CHECK(histogram.quantile_ns(0.5) == 0);
  CHECK(histogram.quantile_ns(1) == int64_t{1} << 60);
  std::vector<int64_t> edges;
  histogram.for_each([&](int64_t edge_ns, uint64_t) { edges.push_back(edge_ns); });
  CHECK(edges == std::vector<int64_t>{0, int64_t{1} << 60});
}
