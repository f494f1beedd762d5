// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/robot_track.hpp"

namespace takt::ground_map {

void RobotTrack::insert(int64_t stamp_ns, const Transform& robot_in_map) {
  const UncertainPose pose{robot_in_map, {}};
  const InsertResult result = track_.insert(stamp_ns, pose);
  if (result == InsertResult::invalid || result == InsertResult::out_of_range || stamp_ns < last_.stamp_ns) return;
  if (stamp_ns > last_.stamp_ns) before_ = last_;
  last_ = {stamp_ns, normalised(pose)};
}

std::optional<Transform> RobotTrack::at(int64_t stamp_ns) const {
  const auto pose = track_.at(stamp_ns);
  return pose ? std::optional(pose->transform) : std::nullopt;
}

std::optional<Transform> RobotTrack::predicted(int64_t stamp_ns) const {
  if (before_.stamp_ns == INT64_MIN) return std::nullopt;
  const int64_t step = last_.stamp_ns - before_.stamp_ns, ahead = stamp_ns - last_.stamp_ns;
  if (step <= 0 || step > kLongestGapNs || ahead < 0 || ahead > kLongestGapNs) return std::nullopt;
  const double fraction = 1 + static_cast<double>(ahead) / static_cast<double>(step);
  return interpolate(before_.pose, last_.pose, fraction).transform;
}

Transform robot_pose(const Transform& camera_in_first, const Transform& camera_in_robot) {
  const UncertainPose mount{camera_in_robot, {}}, moved{camera_in_first, {}};
  return compose(compose(mount, moved), inverse(mount)).transform;
}

}  // namespace takt::ground_map
