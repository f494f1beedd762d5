// SPDX-License-Identifier: Apache-2.0
#include "hal/base/wheel_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace takt::base {
namespace {

/// Between two looks the stamps of frames jitter by up to this, as the bus and the kernel deliver them.
constexpr int64_t kJitter_ns = 20'000'000;

/// Where an arc of that length and turn ends, seen from its beginning.
PlanarPose arc(double length_m, double turn_rad) {
  const double half = turn_rad / 2;
  const double chord_m = length_m * (std::abs(half) > 1e-9 ? std::sin(half) / half : 1.0);
  return {chord_m * std::cos(half), chord_m * std::sin(half), turn_rad};
}

}  // namespace

double WheelOdometry::way_m(uint32_t from, uint32_t to) const {
  const int64_t ahead = (int64_t{to} + counts_ - from) % counts_;
  return static_cast<double>(ahead < counts_ / 2 ? ahead : ahead - counts_) * geometry_.step_m;
}

bool WheelOdometry::observe(uint32_t left, uint32_t right, int64_t stamp_ns) {
  const auto before = std::exchange(previous_, Counts{left, right, stamp_ns});
  if (before) {
    const double l = way_m(before->left, left), r = way_m(before->right, right);
    const double time_s = static_cast<double>(std::max<int64_t>(stamp_ns - before->stamp_ns, 0) + kJitter_ns) * 1e-9;
    if (std::max(std::abs(l), std::abs(r)) <= fastest_m_s_ * time_s) {
      pose_ = compose(pose_, arc((l + r) / 2, (r - l) / geometry_.track_m));
      return true;
    }
  }
  epoch_ += ever_ ? 1 : 0;
  ever_ = true;
  return false;
}

}  // namespace takt::base
