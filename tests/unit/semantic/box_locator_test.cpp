// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/box_locator.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rt/msg/geometry.hpp"

using namespace takt;
using namespace takt::semantic;

namespace {

constexpr CameraModel kCamera{492.8, 319.5, 239.5, 0.24};

/// A thing 3 m before a wall at 5 m fills the middle of its box; a quarter of a pixel of noise, outliers anywhere.
struct Scene {
  std::vector<int16_t> disparity = std::vector<int16_t>(640 * 480);
  std::vector<uint8_t> fraction = std::vector<uint8_t>(640 * 480);
  std::mt19937 random;

  explicit Scene(uint32_t seed) : random(seed) {}
  void set(int x, int y, double d) {
    const auto at = static_cast<size_t>(y * 640 + x);
    disparity[at] = static_cast<int16_t>(std::lround(d));
    fraction[at] = static_cast<uint8_t>(std::clamp(std::lround(64 * (d - disparity[at])) + 32, 0L, 64L));
  }
  void draw(double z_m, double outliers, double invalid) {
    std::normal_distribution<double> noise(0, 0.25);
    std::uniform_real_distribution<double> share(0, 1), any(1, 149);
    for (int y = 0; y < 480; ++y)
      for (int x = 0; x < 640; ++x) {
        const bool thing = std::abs(x - 400) < 30 && std::abs(y - 260) < 50;
        const double depth = thing ? z_m : 5;
        set(x, y,
            share(random) < outliers ? any(random) : kCamera.focal_px * kCamera.baseline_m / depth + noise(random));
        if (share(random) < invalid) disparity[static_cast<size_t>(y * 640 + x)] = -1;
      }
  }
  DisparityView view() const { return {{disparity.data(), 640, 480}, {fraction.data(), 640, 480}, kCamera}; }
};

}  // namespace

TEST_CASE("a box 3 m away: within 10 cm with 40 % of its disparities wrong, within 2 cm with none") {
  BoxLocator locator(640 * 480, {});
  double worst = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed)
    for (const double outliers : {0.0, 0.2, 0.4}) {
      Scene scene(seed);
      scene.draw(3, outliers, 0.2);
      const auto p = locator.locate(365, 205, 70, 110, scene.view());
      REQUIRE(p);
      const double x_m = (400 - kCamera.cu_px) * 3 / kCamera.focal_px;
      const double error = std::hypot(p->x_m - x_m, p->z_m - 3);
      CHECK(error < (outliers > 0 ? 0.10 : 0.02));
      worst = std::max(worst, error);
    }
  MESSAGE("largest error " << worst << " m");
}

TEST_CASE("a box that shows more of the wall than of the thing: where enough agree on a nearer depth, that is the thing's") {
  const auto off_m = [](double agree, double outliers) {
    BoxLocator locator(640 * 480, {.agree = agree});
    double worst = 0;
    for (uint32_t seed = 1; seed <= 20; ++seed) {
      Scene scene(seed);
      scene.draw(3, outliers, 0.2);
      const auto p = locator.locate(330, 205, 70, 110, scene.view());  // 16 of the 43 columns of its middle
      REQUIRE(p);
      worst = std::max(worst, std::abs(p->z_m - 3));
    }
    return worst;
  };
  CHECK(off_m(0.15, 0) < 0.03);
  CHECK(off_m(0.15, 0.4) < 0.10);
  CHECK(off_m(0, 0.4) > 0.10);    // the median is the wall
  CHECK(off_m(0.9, 0.4) > 0.10);  // nobody agrees: the median
}

TEST_CASE("a box with too few disparities, of nothing near, or outside of the image has no place") {
  BoxLocator locator(640 * 480, {});
  Scene scene(1);
  scene.draw(3, 0, 0.85);
  CHECK_FALSE(locator.locate(365, 205, 70, 110, scene.view()));
  scene.draw(3, 0, 0.75);
  CHECK(locator.locate(365, 205, 70, 110, scene.view()));
  CHECK_FALSE(locator.locate(900, 205, 70, 110, scene.view()));
  CHECK_FALSE(locator.locate(365, 205, 0.1, 0.1, scene.view()));
  CHECK(locator.locate(380, 205, 400, 110, scene.view()));
  std::fill(scene.disparity.begin(), scene.disparity.end(), int16_t{0});
  std::fill(scene.fraction.begin(), scene.fraction.end(), uint8_t{32});
  CHECK_FALSE(locator.locate(365, 205, 70, 110, scene.view()));
}
