// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/evaluate.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::scan_matching {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kChiSquared95 = 7.815;  // three degrees of freedom

/// Steps of one method.
class Tally {
 public:
  explicit Tally(const Limits& limits) : limits_(limits) {}
  void add(const PlanarPose& estimated, const PlanarPose& truth) {
    const StepError e = error_between(estimated, truth);
    metres_.push_back(e.error_m);
    degrees_.push_back(e.error_rad / kDegree);
    within_ += e.error_m <= limits_.error_m && e.error_rad <= limits_.error_deg * kDegree;
    estimated_ = compose(estimated_, estimated);
    truth_ = compose(truth_, truth);
  }
  ErrorFigures figures() const {
    const StepError end = error_between(estimated_, truth_);
    const double share = metres_.empty() ? 0 : static_cast<double>(within_) / static_cast<double>(metres_.size());
    return {quantile(metres_, 0.5),
            quantile(degrees_, 0.5),
            quantile(metres_, 0.95),
            quantile(degrees_, 0.95),
            100 * share,
            end.error_m,
            end.error_rad / kDegree};
  }

 private:
  Limits limits_;
  std::vector<double> metres_, degrees_;
  size_t within_ = 0;
  PlanarPose estimated_, truth_;  ///< chained
};

/// Places of one method.
class Places {
 public:
  void add(const PlanarPose& estimated, const PlanarPose& truth) {
    last_ = error_between(estimated, truth);
    metres_.push_back(last_.error_m);
    degrees_.push_back(last_.error_rad / kDegree);
  }
  PlaceError figures() const {
    const double most = metres_.empty() ? 0 : *std::max_element(metres_.begin(), metres_.end());
    return {quantile(metres_, 0.5), quantile(degrees_, 0.5), most, last_.error_m, last_.error_rad / kDegree};
  }

 private:
  std::vector<double> metres_, degrees_;
  StepError last_;
};

/// How far the surfaces of two scans lie apart.
class Gap {
 public:
  Gap(const Drive& drive, const Parameters& p) : drive_(drive), p_(p.map), map_(drive.beams, one_scan(p.map)) {}
  /// Mean distance of the points of `scan` from the lines of the scan before; 0 where none lie near each other.
  double metres(size_t scan, const PlanarPose& moved) {
    points_of(drive_.sweep(scan - 1), p_.range_max_m, points_);
    map_.add({}, points_);
    points_of(drive_.sweep(scan), p_.range_max_m, points_);
    double sum = 0, count = 0;
    for (const SurfacePoint& point : points_) {
      if (!point.has_normal()) continue;
      const SurfacePoint p = transformed(moved, point);
      const SurfacePoint* m = map_.nearest(p);
      if (m == nullptr) continue;
      sum += std::abs(m->nx * (p.x_m - m->x_m) + m->ny * (p.y_m - m->y_m));
      ++count;
    }
    return count > 0 ? sum / count : 0;
  }

 private:
  static MapParameters one_scan(MapParameters p) {
    p.keyframes = 1;
    return p;
  }
  const Drive& drive_;
  MapParameters p_;
  LocalMap map_;
  std::vector<SurfacePoint> points_;
};

/// Matching with the scan before alone.
Parameters without_map(Parameters p) {
  p.map.keyframes = 1;
  p.keyframe_m = p.keyframe_rad = 0;
  return p;
}

bool covered(const Match& match, const PlanarPose& truth) {
  const PlanarPose& step = match.robot_in_previous;
  const Eigen::Vector3d e(step.x_m - truth.x_m, step.y_m - truth.y_m, wrapped(step.theta_rad - truth.theta_rad));
  return e.dot(match.covariance.ldlt().solve(e)) <= kChiSquared95;
}

}  // namespace

StepError error_between(const PlanarPose& estimated, const PlanarPose& truth) {
  const PlanarPose off = between(truth, estimated);
  return {std::hypot(off.x_m, off.y_m), std::abs(off.theta_rad)};
}

Evaluation evaluate(const Drive& drive, const Parameters& parameters, bool with_odometry, const Limits& limits) {
  ScanMatcher matcher(drive.beams, parameters), mapless(drive.beams, without_map(parameters));
  LoopCloser closer(drive.beams, parameters.map, {});
  Evaluation out;
  Tally matched(limits), odometry(limits);
  Places place, closed;
  Gap gap(drive, parameters);
  std::vector<double> times_ms, gaps, gaps_by_truth, apart_m, apart_deg;
  size_t accepted = 0, inside = 0;
  for (size_t i = 0; i < drive.scans.size(); ++i) {
    const double dt_s = i > 0 ? drive.scans[i].time_s - drive.scans[i - 1].time_s : 0;
    const std::optional<PlanarPose> moved = i > 0 && with_odometry ? std::optional(drive.moved(i)) : std::nullopt;
    const int64_t begin = thread_cpu_ns();
    const Match match = matcher.step(drive.sweep(i), dt_s, moved);
    times_ms.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-6);
    out.poses.push_back(match.robot_in_map);
    const int64_t look = thread_cpu_ns();
    out.loops += match.accepted() && closer.step(match.robot_in_map, matcher.points());
    out.loop_ms_max = std::max(out.loop_ms_max, static_cast<double>(thread_cpu_ns() - look) * 1e-6);
    const PlanarPose truly = between(drive.scans[0].truth, drive.scans[i].truth);
    place.add(match.robot_in_map, truly);
    closed.add(closer.robot_in_map(match.robot_in_map), truly);
    const Match other = mapless.step(drive.sweep(i), dt_s, moved);
    if (i == 0) continue;
    const PlanarPose truth = drive.moved_truly(i);
    ++out.steps;
    ++out.outcomes[static_cast<size_t>(match.outcome)];
    out.path_m += std::hypot(truth.x_m, truth.y_m);
    matched.add(match.robot_in_previous, truth);
    odometry.add(drive.moved(i), truth);
    const StepError apart = error_between(match.robot_in_previous, other.robot_in_previous);
    apart_m.push_back(apart.error_m);
    apart_deg.push_back(apart.error_rad / kDegree);
    gaps.push_back(gap.metres(i, match.robot_in_previous));
    gaps_by_truth.push_back(gap.metres(i, truth));
    if (match.outcome != Outcome::matched) continue;
    ++accepted;
    inside += covered(match, truth);
  }
  out.matched = matched.figures();
  out.odometry = odometry.figures();
  out.place = place.figures();
  out.place_closed = closed.figures();
  out.gap_m = quantile(gaps, 0.5);
  out.gap_by_truth_m = quantile(gaps_by_truth, 0.5);
  out.apart_m = quantile(apart_m, 0.5);
  out.apart_deg = quantile(apart_deg, 0.5);
  out.within_95_pct = accepted > 0 ? 100 * static_cast<double>(inside) / static_cast<double>(accepted) : 0;
  out.time_ms_p50 = quantile(times_ms, 0.5);
  out.time_ms_max = times_ms.empty() ? 0 : *std::max_element(times_ms.begin(), times_ms.end());
  return out;
}

}  // namespace takt::scan_matching
