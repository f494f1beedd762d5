// SPDX-License-Identifier: Apache-2.0
// Which returns of a sweep have moved in: where beams of earlier sweeps passed through.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/obstacle_stop/sweep.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/state_archive.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::obstacle_stop {

/// The last sweeps with the robot's poses in an odometry frame, which may drift (where it jumps, all has moved in
/// once). One thread at a time; allocates in the constructor alone.
class SweepMemory {
 public:
  /// For sweeps of at most `beams` beams and looking back for so long; one without beams remembers nothing.
  explicit SweepMemory(size_t beams = 0, int64_t span_ns = 0);
  /// Looks back for so long from now on; a longer span fills as sweeps come.
  void tune(int64_t span_ns) { span_ns_ = span_ns; }

  /// The ranges of `sweep`, taken by the robot at `robot`, of what has moved in, 0 for all others: returns within
  /// `reach_m` of the robot's centre where an earlier sweep of the last `span_ns` saw farther, in all beams within
  /// kAside_rad of them, by kDeeper_m or more. What no beam could tell - behind something, outside the scanner's view,
  /// blinded, so far from it that its beams leave gaps of kGap_m - has not. Valid until the next call.
  std::span<const float> moved_in(const Sweep& sweep, const PlanarPose& robot, int64_t stamp_ns, double reach_m);

  /// Keeps it, unless it is older than the newest kept or too soon after it: kSweeps of them share the span.
  void add(const Sweep& sweep, const PlanarPose& robot, int64_t stamp_ns);

  void remember(StateArchive& archive);

  static constexpr size_t kSweeps = 8;
  static constexpr double kAside_rad = 0.035;  ///< 2 degrees: turn of the robot during a sweep, odometry, mounts
  static constexpr double kDeeper_m = 0.15;    ///< noise of both ranges, odometry
  static constexpr double kGap_m = 0.05;

 private:
  struct Kept {
    double first_angle_rad = 0, step_rad = 0;
    PlaneTransform mount{Transform{}};
    PlanarPose robot;
    int64_t stamp_ns = 0;
    size_t beams = 0;
    std::vector<float> range_m;  ///< of the beams, and room for more
    void remember(StateArchive& archive) {
      TAKT_STATE(archive, first_angle_rad, step_rad, mount, robot, stamp_ns, beams, range_m);
    }
  };
  bool saw_through(const Kept& earlier, const PlanarPoint& in_odometry) const;

  int64_t span_ns_;
  std::array<Kept, kSweeps> kept_;
  size_t count_ = 0, newest_ = 0;
  std::vector<float> moved_in_m_;
};

}  // namespace takt::obstacle_stop
