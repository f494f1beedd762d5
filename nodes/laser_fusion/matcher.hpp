// SPDX-License-Identifier: Apache-2.0
// Two clouds and how well a pose brings them together. The fixed one is the laser's (C1 of the thesis), the moving one
// the camera's (C2): E-29.
#pragma once
#include <span>
#include <vector>

#include "nodes/laser_fusion/nearest_table.hpp"
#include "nodes/laser_fusion/pose_judge.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

class Matcher final : public PoseJudge {
 public:
  /// Takes the memory for clouds of so many points; nothing else allocates.
  Matcher(size_t fixed_points, size_t moving_points, const QualityParameters& parameters,
          size_t voxels = NearestTable::kUsualVoxels);

  /// Clouds of usable points to be matched from now on, copied; points beyond the capacity are left out.
  void set(std::span<const Point> fixed, std::span<const Point> moving);
  /// The same in portions: nothing may be judged before go_on() has said that it is done.
  void begin(std::span<const Point> fixed, std::span<const Point> moving);
  bool go_on() { return table_.go_on(); }
  /// From the next clouds on.
  void tune(const QualityParameters& parameters) { parameters_ = parameters; }
  /// Another cut for the same clouds.
  void set_cut(double cut_m);

  /// The nearest moving point for each fixed one at that pose, judged. Not the moving cloud is moved but the fixed one
  /// back to it: so the table of the moving cloud holds for every pose.
  Quality evaluate(const Rigid& moving_in_fixed) override;
  /// The same without the table: every point against every other.
  Quality evaluate_reference(const Rigid& moving_in_fixed);

  const PairSums& pairs() const override { return sums_; }
  /// Of the last evaluation, one for each fixed point.
  std::span<const Nearest> nearest() const { return nearest_; }
  std::span<const Point> fixed() const { return fixed_; }
  std::span<const Point> moving() const { return table_.points(); }
  const QualityParameters& parameters() const { return parameters_; }

 private:
  double reach_m() const;

  QualityParameters parameters_;
  size_t fixed_capacity_;
  NearestTable table_;  ///< of the moving cloud
  std::vector<Point> fixed_;
  std::vector<Nearest> nearest_;
  PairSums sums_;
};

}  // namespace takt::laser_fusion
