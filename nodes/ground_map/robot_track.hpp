// SPDX-License-Identifier: Apache-2.0
// Where the robot was when an image was taken, from poses at other instants.
#pragma once
#include <cstdint>
#include <optional>

#include "rt/msg/geometry.hpp"
#include "rt/state_archive.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt::ground_map {

/// Poses of the robot in the map over time. Allocates in the constructor only.
class RobotTrack {
 public:
  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses, and from the last to what is predicted

  explicit RobotTrack(size_t capacity) : track_(capacity, kLongestGapNs) {}
  /// Poses may come again; invalid ones are dropped.
  void insert(int64_t stamp_ns, const Transform& robot_in_map);
  /// At that stamp or between two poses.
  std::optional<Transform> at(int64_t stamp_ns) const;
  /// After the last pose, at constant motion as between the last two.
  std::optional<Transform> predicted(int64_t stamp_ns) const;
  void remember(StateArchive& archive) { TAKT_STATE(archive, track_, last_, before_); }

 private:
  PoseTrack track_;
  StampedPose last_{INT64_MIN, {}}, before_{INT64_MIN, {}};
};

/// The robot's pose from that of a camera that sits on it: both relative to where they were in the first image
/// (erratum E-25). The map frame is the robot frame of the first image.
Transform robot_pose(const Transform& camera_in_first, const Transform& camera_in_robot);

}  // namespace takt::ground_map
