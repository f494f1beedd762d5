// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/scan_matcher.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr double kLongestStretch = 10;  // a motion is not continued for longer than so many times its own duration

}  // namespace

std::string_view to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::matched: return "matched";
    case Outcome::first: return "first";
    case Outcome::too_few_points: return "too few points";
    case Outcome::poor_score: return "poor score";
    case Outcome::poor_pairs: return "poor pairs";
    case Outcome::not_converged: return "not converged";
  }
  return "?";
}

ScanMatcher::ScanMatcher(size_t beams, const Parameters& parameters)
    : p_(parameters), map_(beams, p_.map), search_(beams, p_.search, p_.map.cell_m) {
  points_.reserve(beams);
}

void ScanMatcher::resume(const UncertainPose& robot_in_map) {
  pose_ = planar(robot_in_map.transform);
  accumulated_ = robot_in_map;
}

Expected ScanMatcher::expect(double dt_s, const std::optional<PlanarPose>& moved) const {
  Expected out;
  if (moved) {
    const double distance_m = std::hypot(moved->x_m, moved->y_m), turn_rad = std::abs(moved->theta_rad);
    out.robot_in_map = compose(pose_, *moved);
    out.sigma_m = p_.odometry_floor_m + p_.odometry_error * distance_m;
    out.sigma_rad = p_.odometry_floor_rad + p_.odometry_turn_error * turn_rad + p_.odometry_drift_rad_m * distance_m;
    return out;
  }
  const double stretch = last_dt_s_ > 0 ? std::clamp(dt_s / last_dt_s_, 0.0, kLongestStretch) : 0;
  out.robot_in_map =
      compose(pose_, {last_step_.x_m * stretch, last_step_.y_m * stretch, last_step_.theta_rad * stretch});
  // The speed is known as the mean of the last interval (nodes/ego_motion, expectation.hpp).
  const double error_s2 = 0.5 * dt_s * (dt_s + last_dt_s_);
  out.sigma_m = p_.odometry_floor_m + p_.acceleration_m_s2 * error_s2;
  out.sigma_rad = p_.odometry_floor_rad + p_.turn_acceleration_rad_s2 * error_s2;
  return out;
}

/// Says where the scan fits; out.refined as far as it came.
Outcome ScanMatcher::match(const Expected& expected, Match& out) {
  if (out.points < p_.points_min) return Outcome::too_few_points;
  if (map_.empty()) return Outcome::first;
  const Found found = search_.find(map_.field(), points_, expected);
  out.score = (found.score + found.penalty) / (255.0 * static_cast<double>(points_.size()));
  if (out.score < p_.score_min) return Outcome::poor_score;
  out.refined = refine(map_, points_, expected, found.robot_in_map, p_.refine);
  if (out.refined.paired < p_.paired_min * out.points) return Outcome::poor_pairs;
  const PlanarPose led = between(found.robot_in_map, out.refined.robot_in_map);
  const bool away = std::hypot(led.x_m, led.y_m) > p_.map.gate_m || std::abs(led.theta_rad) > p_.search.reach_rad / 2;
  return out.refined.converged && !away ? Outcome::matched : Outcome::not_converged;
}

void ScanMatcher::keep(const PlanarPose& robot_in_map) {
  map_.add(robot_in_map, points_);
  keyframe_ = robot_in_map;
}

Match ScanMatcher::step(const Sweep& sweep, double dt_s, const std::optional<PlanarPose>& moved) {
  points_of(sweep, p_.map.range_max_m, points_);
  Match out;
  out.points = static_cast<int>(
      std::count_if(points_.begin(), points_.end(), [](const SurfacePoint& p) { return p.has_normal(); }));
  const Expected expected = expect(dt_s, moved);
  Expected overall = expected;  // with what refused scans have left uncertain
  overall.sigma_m = std::hypot(expected.sigma_m, unsure_m_);
  overall.sigma_rad = std::hypot(expected.sigma_rad, unsure_rad_);
  out.outcome = match(overall, out);

  Covariance in_map = Eigen::Vector3d(expected.sigma_m * expected.sigma_m, expected.sigma_m * expected.sigma_m,
                                      expected.sigma_rad * expected.sigma_rad)
                          .asDiagonal();
  if (out.outcome == Outcome::matched) in_map = out.refined.covariance;
  if (out.outcome == Outcome::first) in_map.setZero();
  out.robot_in_map = out.outcome == Outcome::matched ? out.refined.robot_in_map
                     : out.outcome == Outcome::first ? pose_
                                                     : expected.robot_in_map;
  out.robot_in_previous = between(pose_, out.robot_in_map);
  out.covariance = turned(in_map, -pose_.theta_rad);
  out.accumulated = accumulated_ = compose(accumulated_, spatial(out.robot_in_previous, out.covariance));
  pose_ = out.robot_in_map;
  last_step_ = out.robot_in_previous;
  last_dt_s_ = dt_s;

  refused_ = out.accepted() ? 0 : refused_ + 1;
  unsure_m_ = out.accepted() ? 0 : overall.sigma_m;
  unsure_rad_ = out.accepted() ? 0 : overall.sigma_rad;
  out.map_anew = refused_ >= p_.refused_most && out.points >= p_.points_min;
  if (out.map_anew) {
    map_.clear();
    refused_ = 0;
    unsure_m_ = unsure_rad_ = 0;
  }
  const PlanarPose since = between(keyframe_, pose_);
  out.keyframe = out.map_anew || out.outcome == Outcome::first ||
                 (out.outcome == Outcome::matched &&
                  (std::hypot(since.x_m, since.y_m) > p_.keyframe_m || std::abs(since.theta_rad) > p_.keyframe_rad));
  if (out.keyframe) keep(pose_);
  return out;
}

}  // namespace takt::scan_matching
