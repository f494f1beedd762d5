// SPDX-License-Identifier: Apache-2.0
#include "nodes/obstacle_stop/sweep_memory.hpp"

#include <algorithm>
#include <cmath>

namespace takt::obstacle_stop {
namespace {

PlanarPoint to_parent(const PlanarPose& pose, const PlanarPoint& p) {
  const PlanarPose at = compose(pose, {p.x_m, p.y_m, 0});
  return {at.x_m, at.y_m};
}

PlanarPoint from_parent(const PlanarPose& pose, const PlanarPoint& p) {
  const PlanarPose at = between(pose, {p.x_m, p.y_m, 0});
  return {at.x_m, at.y_m};
}

}  // namespace

SweepMemory::SweepMemory(size_t beams, int64_t span_ns) : span_ns_(span_ns), moved_in_m_(beams) {
  for (Kept& kept : kept_) kept.range_m.resize(beams);
}

void SweepMemory::add(const Sweep& sweep, const PlanarPose& robot, int64_t stamp_ns) {
  if (sweep.range_m.size() > moved_in_m_.size()) return;
  if (count_ > 0 && stamp_ns - kept_[newest_].stamp_ns < span_ns_ / static_cast<int64_t>(kSweeps)) return;
  newest_ = (newest_ + 1) % kSweeps;
  count_ = std::min(count_ + 1, kSweeps);
  Kept& kept = kept_[newest_];
  std::copy(sweep.range_m.begin(), sweep.range_m.end(), kept.range_m.begin());
  kept.beams = sweep.range_m.size();
  kept.first_angle_rad = sweep.first_angle_rad;
  kept.step_rad = sweep.step_rad;
  kept.mount = PlaneTransform(sweep.sensor_in_robot);
  kept.robot = robot;
  kept.stamp_ns = stamp_ns;
}

void SweepMemory::remember(StateArchive& archive) {
  TAKT_STATE(archive, kept_, count_, newest_);
  const bool fits = std::all_of(kept_.begin(), kept_.end(), [&](const Kept& kept) {
    return kept.range_m.size() == moved_in_m_.size() && kept.beams <= moved_in_m_.size();
  });
  if (!fits || count_ > kSweeps || newest_ >= kSweeps) archive.fail();
}

std::span<const float> SweepMemory::moved_in(const Sweep& sweep, const PlanarPose& robot, int64_t stamp_ns,
                                             double reach_m) {
  const size_t beams = std::min(sweep.range_m.size(), moved_in_m_.size());
  const PlaneTransform mount(sweep.sensor_in_robot);
  for (size_t beam = 0; beam < beams; ++beam) {
    const float range = sweep.range_m[beam];
    moved_in_m_[beam] = 0;
    if (!(range > 0)) continue;
    const PlanarPoint place = mount.place(sweep, beam, static_cast<double>(range));
    if (std::hypot(place.x_m, place.y_m) > reach_m) continue;
    const PlanarPoint in_odometry = to_parent(robot, place);
    for (size_t i = 0; i < count_; ++i) {
      const Kept& earlier = kept_[(newest_ + kSweeps - i) % kSweeps];
      if (stamp_ns - earlier.stamp_ns > span_ns_) break;
      if (!saw_through(earlier, in_odometry)) continue;
      moved_in_m_[beam] = range;
      break;
    }
  }
  return std::span(moved_in_m_).first(beams);
}

bool SweepMemory::saw_through(const Kept& earlier, const PlanarPoint& in_odometry) const {
  const PlaneTransform& m = earlier.mount;
  const PlanarPoint p = from_parent(earlier.robot, in_odometry);
  const double dx = p.x_m - m.x, dy = p.y_m - m.y, determinant = m.xx * m.yy - m.xy * m.yx;
  const double right = (m.yy * dx - m.yx * dy) / determinant, ahead = (m.xx * dy - m.xy * dx) / determinant;
  const double range = std::hypot(right, ahead);
  if (range * earlier.step_rad > kGap_m) return false;
  const double beam = (std::atan2(-right, ahead) - earlier.first_angle_rad) / earlier.step_rad;
  const double aside = std::max(1.0, kAside_rad / earlier.step_rad);
  const double first = std::ceil(beam - aside), last = std::floor(beam + aside);
  if (!(first >= 0 && last < static_cast<double>(earlier.beams))) return false;  // NaN as well
  const auto farther = [&](float seen) { return seen == 0 || static_cast<double>(seen) > range + kDeeper_m; };
  return std::all_of(earlier.range_m.begin() + static_cast<ptrdiff_t>(first),
                     earlier.range_m.begin() + static_cast<ptrdiff_t>(last) + 1, farther);
}

}  // namespace takt::obstacle_stop
