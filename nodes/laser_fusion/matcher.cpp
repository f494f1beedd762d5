// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/matcher.hpp"

#include <algorithm>

namespace takt::laser_fusion {
namespace {

/// The thesis's metric needs the nearest point however far it is; those beyond this are searched for.
constexpr double kThesisReach_m = 1.0;

IntoChild into_child(const Rigid& pose) {
  IntoChild out;
  Eigen::Map<Eigen::Matrix3f>(out.r) = pose.R.cast<float>();  // column-major as Eigen has it: R^T row-major
  Eigen::Map<Eigen::Vector3f>(out.t) = pose.t.cast<float>();
  return out;
}

}  // namespace

Matcher::Matcher(size_t fixed_points, size_t moving_points, const QualityParameters& parameters, size_t voxels)
    : parameters_(parameters), fixed_capacity_(fixed_points), table_(moving_points, voxels) {
  fixed_.reserve(fixed_points);
  nearest_.reserve(fixed_points);
}

void Matcher::set(std::span<const Point> fixed, std::span<const Point> moving) {
  begin(fixed, moving);
  while (!go_on()) {
  }
}

void Matcher::begin(std::span<const Point> fixed, std::span<const Point> moving) {
  fixed = fixed.first(std::min(fixed.size(), fixed_capacity_));
  fixed_.assign(fixed.begin(), fixed.end());
  nearest_.resize(fixed.size());
  table_.begin(moving, reach_m());
}

void Matcher::set_cut(double cut_m) {
  parameters_.cut_m = cut_m;
  table_.set_reach(reach_m());
}

double Matcher::reach_m() const { return parameters_.metric == Metric::truncated ? parameters_.cut_m : kThesisReach_m; }

Quality Matcher::evaluate(const Rigid& moving_in_fixed) {
  const IntoChild into_moving = into_child(moving_in_fixed);
  table_.nearest(into_moving, fixed_, nearest_);
  if (parameters_.metric == Metric::thesis)
    for (size_t i = 0; i < fixed_.size(); ++i)
      if (!(nearest_[i].distance2 <= static_cast<float>(kThesisReach_m * kThesisReach_m)))
        nearest_[i] = nearest_reference(table_.points(), into_moving(fixed_[i]));
  return judge({fixed_, table_.points(), nearest_}, parameters_, sums_);
}

Quality Matcher::evaluate_reference(const Rigid& moving_in_fixed) {
  const IntoChild into_moving = into_child(moving_in_fixed);
  for (size_t i = 0; i < fixed_.size(); ++i) nearest_[i] = nearest_reference(table_.points(), into_moving(fixed_[i]));
  return judge({fixed_, table_.points(), nearest_}, parameters_, sums_);
}

}  // namespace takt::laser_fusion
