// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

#include "rt/transform/planar_pose.hpp"

namespace takt::base {

/// Geometry of a differential drive.
struct WheelGeometry {
  double step_m = 0.05e-3;  ///< way of the wheel's rim per encoder count
  double track_m = 0.5;     ///< from wheel to wheel
};

/// The pose that counted wheels make: each pair of counts is one exact arc. The pose is kept when the counts start
/// anew; the epoch then rises. No allocation.
class WheelOdometry {
 public:
  /// `counts`: the number at which both counters wrap; `fastest_m_s`: no wheel runs faster.
  WheelOdometry(const WheelGeometry& geometry, uint32_t counts, double fastest_m_s)
      : geometry_(geometry), counts_(counts), fastest_m_s_(fastest_m_s) {}

  /// Counts as they were at an instant. False, and the pose as it was, if they start anew: the first ones, those after
  /// forget(), and a way that no wheel can have run since the ones before.
  bool observe(uint32_t left, uint32_t right, int64_t stamp_ns);
  /// The base was restarted or away: what it counted meanwhile is unknown.
  void forget() { previous_.reset(); }

  const PlanarPose& pose() const { return pose_; }
  uint32_t epoch() const { return epoch_; }

 private:
  struct Counts {
    uint32_t left, right;
    int64_t stamp_ns;
  };
  /// The shorter way round from one count to the other, m.
  double way_m(uint32_t from, uint32_t to) const;

  WheelGeometry geometry_;
  uint32_t counts_;
  double fastest_m_s_;
  std::optional<Counts> previous_;
  bool ever_ = false;
  PlanarPose pose_;
  uint32_t epoch_ = 0;
};

}  // namespace takt::base
