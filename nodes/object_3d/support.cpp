// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/support.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace takt::object_3d {
namespace {

constexpr double kBin_m = 0.01;
constexpr size_t kBins = 1000;

/// Middle of the bins with most points; a plane that lies between two bins counts with both.
std::optional<double> busiest_level(std::span<const Point> points, const SupportParameters& p) {
  std::array<size_t, kBins> count{};
  const auto bins = std::min(kBins, static_cast<size_t>(std::max(1.0, std::ceil((p.high_m - p.low_m) / kBin_m))));
  for (const Point& point : points) {
    const double bin = std::floor((static_cast<double>(point.z) - p.low_m) / kBin_m);
    if (bin >= 0 && bin < static_cast<double>(bins)) ++count[static_cast<size_t>(bin)];
  }
  size_t best = 0, most = 0;
  for (size_t b = 0; b < bins; ++b) {
    const size_t around = count[b] + (b > 0 ? count[b - 1] : 0) + (b + 1 < bins ? count[b + 1] : 0);
    if (around > most) most = around, best = b;
  }
  if (most == 0) return std::nullopt;
  return p.low_m + (static_cast<double>(best) + 0.5) * kBin_m;
}

}  // namespace

std::optional<Plane> find_support(std::span<const Point> points, const SupportParameters& p) {
  const std::optional<double> level = busiest_level(points, p);
  if (!level) return std::nullopt;
  Plane plane{0, 0, *level};
  for (int round = 0; round < 3; ++round) {
    const double band = round == 0 ? 2 * p.band_m : p.band_m;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    size_t own = 0;
    for (const Point& point : points) {
      if (std::abs(plane.above(point)) > band) continue;
      const Eigen::Vector3d row(static_cast<double>(point.x), static_cast<double>(point.y), 1);
      normal += row * row.transpose();
      right += row * static_cast<double>(point.z);
      ++own;
    }
    if (own < std::max<size_t>(3, p.fewest)) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d found = solver.solve(right);
    if (!found.allFinite() || std::hypot(found.x(), found.y()) > p.slope_max) return std::nullopt;
    plane = {found.x(), found.y(), found.z()};
  }
  return plane;
}

}  // namespace takt::object_3d
