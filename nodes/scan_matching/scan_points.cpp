// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/scan_points.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr int kReach = 3, kFarthest = 20;  // neighbours to each side: at least, and at most where they lie dense
constexpr double kReach_m = 0.2;           // then they reach so far
constexpr int kFewest = 4;                 // points of a line
constexpr double kLargestRms_m = 0.05, kLargestRatio = 0.2;
constexpr double kGap_m = 0.10;  // between neighbours on one surface, plus
constexpr double kGapSteps = 4;  // so many times their distance on a surface that faces the scanner

bool returned(const Sweep& sweep, int beam, double range_max_m) {
  const auto i = static_cast<size_t>(beam);
  return beam >= 0 && i < sweep.range_m.size() && sweep.range_m[i] > 0 && sweep.range_m[i] <= range_max_m;
}

/// In the scanner's frame.
Eigen::Vector2d place(const Sweep& sweep, int beam) {
  const double range = sweep.range_m[static_cast<size_t>(beam)], angle = sweep.first_angle_rad + beam * sweep.step_rad;
  return {-range * std::sin(angle), range * std::cos(angle)};
}

/// How far the surface of `beam` goes on in one direction, in beams.
int extent(const Sweep& sweep, int beam, int direction, double range_max_m) {
  int reached = 0;
  while (reached < kFarthest) {
    const int from = beam + direction * reached, to = from + direction;
    if (!returned(sweep, to, range_max_m)) break;
    const double range = sweep.range_m[static_cast<size_t>(from)];
    if ((place(sweep, to) - place(sweep, from)).norm() > kGap_m + kGapSteps * range * sweep.step_rad) break;
    if (reached >= kReach && (place(sweep, to) - place(sweep, beam)).norm() > kReach_m) break;
    ++reached;
  }
  return reached;
}

/// Of the line through beams first..last, towards the scanner; zero if they do not lie on one.
Eigen::Vector2d normal(const Sweep& sweep, int first, int last) {
  const int n = last - first + 1;
  if (n < kFewest) return Eigen::Vector2d::Zero();
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int i = first; i <= last; ++i) mean += place(sweep, i);
  mean /= n;
  double xx = 0, xy = 0, yy = 0;
  for (int i = first; i <= last; ++i) {
    const Eigen::Vector2d d = place(sweep, i) - mean;
    xx += d.x() * d.x();
    xy += d.x() * d.y();
    yy += d.y() * d.y();
  }
  // Eigenvalues of the 2 x 2 scatter matrix: extent along the line and off it.
  const double middle = (xx + yy) / 2, radius = std::hypot((xx - yy) / 2, xy);
  const double along = std::sqrt((middle + radius) / n), off = std::sqrt(std::max(0.0, middle - radius) / n);
  if (off > kLargestRms_m || off > kLargestRatio * along) return Eigen::Vector2d::Zero();
  const double direction = 0.5 * std::atan2(2 * xy, xx - yy);
  const Eigen::Vector2d across(-std::sin(direction), std::cos(direction));
  return across.dot(mean) > 0 ? Eigen::Vector2d(-across) : across;
}

}  // namespace

void points_of(const Sweep& sweep, double range_max_m, std::vector<SurfacePoint>& points) {
  points.clear();
  for (int i = 0; i < static_cast<int>(sweep.range_m.size()); ++i) {
    if (!returned(sweep, i, range_max_m)) continue;
    const Eigen::Vector2d p = place(sweep, i);
    const Eigen::Vector2d n =
        normal(sweep, i - extent(sweep, i, -1, range_max_m), i + extent(sweep, i, 1, range_max_m));
    points.push_back(transformed(sweep.sensor_in_robot, {p.x(), p.y(), n.x(), n.y()}));
  }
}

}  // namespace takt::scan_matching
