// SPDX-License-Identifier: Apache-2.0
// What an LMS400 that is tilted to the floor sees of a floor with heights.
#pragma once
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::test {

using Floor = std::function<double(double x_m, double y_m)>;

struct TiltedLaser {
  double height_m = 1.0, ahead_m = 0.2, tilt_rad = 0.6;  ///< tilted down
  double field_rad = 1.22, noise_m = 0.004;              ///< 70 degrees
  uint32_t beams = 281;

  double first_angle_rad() const { return -field_rad / 2; }
  double step_rad() const { return field_rad / (beams - 1); }
  /// The scanner's plane is the x-y plane turned about x, its forward axis y down.
  Transform mount() const { return {0, ahead_m, height_m, std::cos(tilt_rad / 2), -std::sin(tilt_rad / 2), 0, 0}; }

  /// Ranges of one sweep of a robot at (x, y) that looks along the map's y axis; 0 where nothing lies within 5 m.
  std::vector<float> look(const Floor& floor, double x_m, double y_m, std::mt19937_64& random) const {
    std::normal_distribution<> noise(0, noise_m);
    const mapping_3d::Affine to_robot = mapping_3d::to_affine(mount());
    std::vector<float> ranges;
    for (uint32_t i = 0; i < beams; ++i) {
      const double angle = first_angle_rad() + i * step_rad();
      const auto above = [&](double range) {
        const mapping_3d::Position p = transformed(to_robot, -range * std::sin(angle), range * std::cos(angle), 0);
        return p.z_m - floor(x_m + p.x_m, y_m + p.y_m);
      };
      double low = 0, high = 0;
      while (high < 5 && above(high) > 0) low = high, high += 0.01;
      for (int k = 0; k < 10; ++k) (above((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
      ranges.push_back(high < 5 ? static_cast<float>(high + noise(random)) : 0.0f);
    }
    return ranges;
  }
};

}  // namespace takt::test
