// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/loop_closer.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr size_t kBeside = 2;         // anchors to each side of the one that is seen again
constexpr double kCell_m = 0.10;      // of the score field: the search is wide, and the refinement exact
constexpr double kStep_rad = 0.0175;  // of the search: 10 cm at 6 m
constexpr int kLeastPoints = 20;      // with a normal

MapParameters around_anchor(MapParameters map) {
  map.keyframes = 2 * kBeside + 1;
  map.cell_m = kCell_m;
  map.sigma_m = 1.5 * kCell_m;
  return map;
}

bool far(const PlanarPose& pose, double most_m, double most_rad) {
  return std::hypot(pose.x_m, pose.y_m) > most_m || std::abs(pose.theta_rad) > most_rad;
}

}  // namespace

LoopCloser::LoopCloser(size_t beams, const MapParameters& map, const ClosureParameters& parameters)
    : p_(parameters),
      map_(beams, around_anchor(map)),
      search_(beams, {p_.drift_m, p_.drift_rad, kStep_rad}, kCell_m),
      ring_(p_.anchors) {
  for (Anchor& anchor : ring_) anchor.points.reserve(beams);
}

std::optional<Closure> LoopCloser::step(const PlanarPose& robot_in_track, std::span<const SurfacePoint> points) {
  if (last_) {
    const PlanarPose moved = between(*last_, robot_in_track);
    way_m_ += std::hypot(moved.x_m, moved.y_m);
  }
  last_ = robot_in_track;
  if (kept_ && !far(between(*kept_, robot_in_track), p_.anchor_m, p_.anchor_rad)) return std::nullopt;
  kept_ = robot_in_track;

  std::optional<Closure> closed;
  const PlanarPose believed = robot_in_map(robot_in_track);
  const std::optional<size_t> place = known_place(believed);
  const std::optional<PlanarPose> actual = place ? match(*place, believed, points) : std::nullopt;
  if (actual) {
    // Two looks in a row that say the same of the drift: what fits by chance once does not fit again.
    const PlanarPose found = compose(*actual, between(robot_in_track, {}));
    const bool agree = found_ && !far(between(*actual, compose(*found_, robot_in_track)), p_.agree_m, p_.agree_rad);
    found_ = found;
    if (agree && far(between(believed, *actual), p_.least_m, p_.least_rad)) {
      closed = Closure{believed, *actual};
      correct(*place, *closed);
      map_from_track_ = found;
    }
  } else if (place) {
    found_.reset();
  }
  keep(robot_in_map(robot_in_track), points);
  return closed;
}

void LoopCloser::remember(StateArchive& archive) {
  TAKT_STATE(archive, first_, count_, map_from_track_, last_, kept_, found_, way_m_, right_until_m_);
  if (first_ >= ring_.size() || count_ > ring_.size()) return archive.fail();
  for (size_t i = 0; i < count_; ++i) archive(anchor(i));
  // Of those to come.
  for (size_t i = count_; i < ring_.size(); ++i)
    archive.room(sizeof(Anchor) + anchor(i).points.capacity() * sizeof(SurfacePoint));
}

void LoopCloser::keep(const PlanarPose& robot_in_map, std::span<const SurfacePoint> points) {
  if (count_ == ring_.size()) first_ = (first_ + 1) % ring_.size();
  else ++count_;
  Anchor& newest = anchor(count_ - 1);
  newest.robot_in_map = robot_in_map;
  newest.way_m = way_m_;
  newest.points.assign(points.begin(),
                       points.begin() + static_cast<ptrdiff_t>(std::min(points.size(), newest.points.capacity())));
}

/// The nearest anchor that closes a loop.
std::optional<size_t> LoopCloser::known_place(const PlanarPose& robot_in_map) {
  std::optional<size_t> nearest;
  double nearest_m = p_.reach_m;
  for (size_t i = 0; i < count_ && anchor(i).way_m <= way_m_ - p_.way_m; ++i) {
    const PlanarPose to = between(anchor(i).robot_in_map, robot_in_map);
    const double away_m = std::hypot(to.x_m, to.y_m);
    if (away_m > nearest_m || std::abs(to.theta_rad) > p_.reach_rad) continue;
    nearest_m = away_m;
    nearest = i;
  }
  return nearest;
}

/// Where the robot stands among the scans about that anchor; none if it does not see them for sure.
std::optional<PlanarPose> LoopCloser::match(size_t place, const PlanarPose& robot_in_map,
                                            std::span<const SurfacePoint> points) {
  const auto lines = std::count_if(points.begin(), points.end(), [](const SurfacePoint& p) { return p.has_normal(); });
  if (lines < kLeastPoints) return std::nullopt;
  map_.clear();
  const size_t first = place - std::min(place, kBeside), last = std::min(place + kBeside, count_ - 1);
  for (size_t i = first; i <= last; ++i)
    if (i != place) map_.add(anchor(i).robot_in_map, anchor(i).points);
  map_.add(anchor(place).robot_in_map, anchor(place).points);  // last: its place is the middle of the field
  const Expected expected{robot_in_map, p_.drift_m / 2, p_.drift_rad / 2};
  const Found found = search_.find(map_.field(), points, expected);
  if (found.score + found.penalty < p_.score_min * 255 * static_cast<double>(points.size())) return std::nullopt;
  // As sure as the search is of its cell: against that the scan must tell where it is in every direction.
  const Expected cell{found.robot_in_map, kCell_m / 2, kStep_rad};
  const Refined refined = refine(map_, points, cell, found.robot_in_map, {});
  const bool sure = refined.converged && refined.paired >= p_.paired_min * static_cast<double>(lines) &&
                    refined.prior_share <= p_.prior_share_max;
  return sure ? std::optional(refined.robot_in_map) : std::nullopt;
}

void LoopCloser::correct(size_t place, const Closure& closure) {
  const double from_m = std::max(anchor(place).way_m, right_until_m_), loop_m = way_m_ - from_m;
  right_until_m_ = way_m_;
  const PlanarPose error = compose(closure.actual, between(closure.believed, {}));
  for (size_t i = place + 1; i < count_; ++i) {
    if (anchor(i).way_m <= from_m) continue;
    PlanarPose& pose = anchor(i).robot_in_map;
    const double share = (anchor(i).way_m - from_m) / loop_m;
    const PlanarPose all = compose(error, pose);
    pose.x_m += share * (all.x_m - pose.x_m);
    pose.y_m += share * (all.y_m - pose.y_m);
    pose.theta_rad = wrapped(pose.theta_rad + share * wrapped(all.theta_rad - pose.theta_rad));
  }
}

}  // namespace takt::scan_matching
