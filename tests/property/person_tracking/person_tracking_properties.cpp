// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "nodes/person_tracking/person_filter.hpp"
#include "nodes/person_tracking/saddle_kernel.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::person_tracking;

namespace {

Place any_place(std::mt19937_64& random) {
  std::uniform_real_distribution<double> at(-3, 3), deviation(0.05, 0.5), lean(-0.9, 0.9);
  const double a = deviation(random), b = deviation(random), c = lean(random) * a * b;
  Place place;
  place.at = {at(random), at(random)};
  place.covariance << a * a, c, c, b * b;
  return place;
}

}  // namespace

TEST_CASE("the saddle response of a row is that of each of its pixels, on every SIMD target") {
  std::mt19937_64 random(test::seed(3));
  for (const int width : {3, 6, 7, 8, 21, 64, 97, 640}) {
    const int height = 9, stride = width + kRowSlack;
    std::vector<uint8_t> pixels(static_cast<size_t>(stride * height));
    std::vector<int16_t> row(static_cast<size_t>(stride));
    for (const int levels : {2, 256}) {  // black and white, too: the largest sums
      for (uint8_t& p : pixels)
        p = static_cast<uint8_t>(static_cast<int>(random() % static_cast<uint64_t>(levels)) * (255 / (levels - 1)));
      const ImageView<const uint8_t> image(pixels.data(), width, height, 1, stride);
      test::on_each_target([&] {
        for (int y = kRingRadius; y < height - kRingRadius; ++y) {
          saddle_row(image, y, row.data());
          for (int x = 0; x < width; ++x) {
            const bool inside = x >= kRingRadius && x < width - kRingRadius;
            REQUIRE(row[static_cast<size_t>(x)] == (inside ? saddle_response(image, x, y) : 0));
          }
        }
      });
    }
  }
}

TEST_CASE("grey of a row is that of each pixel, on every SIMD target") {
  std::mt19937_64 random(test::seed(4));
  for (const int width : {1, 15, 16, 33, 640}) {
    std::vector<uint8_t> bgr(static_cast<size_t>(3 * width)), grey(static_cast<size_t>(width + kRowSlack));
    for (uint8_t& p : bgr) p = static_cast<uint8_t>(random());
    test::on_each_target([&] {
      grey_row(bgr.data(), width, grey.data());
      for (size_t x = 0; x < static_cast<size_t>(width); ++x)
        REQUIRE(grey[x] == (bgr[3 * x] + 2 * bgr[3 * x + 1] + bgr[3 * x + 2] + 2) / 4);
    });
  }
}

TEST_CASE("the filter's estimate is the least squares of all that was seen") {
  std::mt19937_64 random(test::seed(5));
  std::uniform_real_distribution<double> step(0.02, 0.8), noise(0.05, 4);
  for (int round = 0; round < test::rounds(30); ++round) {
    const FilterParameters p{noise(random), noise(random)};
    PersonFilter filter(p);
    std::vector<TimedPlace> seen;
    for (int i = 0; i < 1 + round % 12; ++i) {
      seen.push_back({i == 0 ? 0 : step(random), any_place(random)});
      if (i == 0) {
        filter.begin(seen[0].place);
      } else {
        filter.predict(seen.back().dt_s);
        filter.update(seen.back().place);
      }
      const Estimate all = filter_reference(p, seen);
      CHECK((filter.estimate().state - all.state).norm() < 1e-6 * (1 + all.state.norm()));
      CHECK((filter.estimate().covariance - all.covariance).norm() < 1e-6 * (1 + all.covariance.norm()));
    }
  }
}

TEST_CASE("two predictions are one of both times; no update makes the filter less certain or its covariance improper") {
  std::mt19937_64 random(test::seed(6));
  std::uniform_real_distribution<double> step(0.01, 1);
  PersonFilter filter({});
  filter.begin(any_place(random));
  for (int i = 0; i < test::rounds(200); ++i) {
    const double a = step(random), b = step(random);
    PersonFilter twice = filter;
    twice.predict(a);
    twice.predict(b);
    CHECK((twice.estimate().covariance - filter.after(a + b).covariance).norm() <
          1e-9 * filter.after(a + b).covariance.norm());
    CHECK((twice.estimate().state - filter.after(a + b).state).norm() < 1e-9 * (1 + filter.after(a + b).state.norm()));
    filter.predict(step(random));
    const double before = filter.estimate().covariance.trace();
    filter.update(any_place(random));
    const Eigen::Matrix4d& p = filter.estimate().covariance;
    CHECK(p.trace() <= before);
    CHECK((p - p.transpose()).norm() < 1e-12 * p.norm());
    CHECK(p.llt().info() == Eigen::Success);
  }
}
