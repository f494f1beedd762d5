// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/pose_parameters.hpp"

#include <cmath>

namespace takt::laser_fusion {

Rigid to_rigid(const PoseParameters& p) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return {(AngleAxisd(p[kYaw], Vector3d::UnitZ()) * AngleAxisd(p[kPitch], Vector3d::UnitX()) *
           AngleAxisd(p[kRoll], Vector3d::UnitY()))
              .toRotationMatrix(),
          {p[kX], p[kY], p[kZ]}};
}

PoseParameters to_parameters(const Rigid& pose) {
  constexpr double kGimbalLock = 1e-9;
  const Eigen::Matrix3d& r = pose.R;
  const double level = std::hypot(r(2, 0), r(2, 2)), pitch = std::atan2(r(2, 1), level);
  double yaw, roll;
  if (level > kGimbalLock) {
    yaw = std::atan2(-r(0, 1), r(1, 1));
    roll = std::atan2(-r(2, 0), r(2, 2));
  } else {
    yaw = std::atan2(r(1, 0), r(0, 0));
    roll = 0;
  }
  return {pose.t.x(), pose.t.y(), pose.t.z(), yaw, pitch, roll};
}

}  // namespace takt::laser_fusion
