// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/pixel_grid.hpp"

#include <algorithm>
#include <cmath>

namespace takt::object_3d {
namespace {

constexpr int kHalfWindow = 2;
/// Determinant of the normal equations, per point cubed, below which the window is a line.
constexpr double kLine = 1e-3;

/// Sums of a plane's normal equations: w = a + b x + c y.
struct PlaneFit {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, w = 0, xw = 0, yw = 0;
  void add(double px, double py, double pw) {
    n += 1, x += px, y += py, xx += px * px, xy += px * py, yy += py * py;
    w += pw, xw += px * pw, yw += py * pw;
  }
  /// The plane's value at (0, 0); the mean where the points lie in a line.
  double at_origin() const {
    const double m0 = xx * yy - xy * xy, m1 = x * yy - xy * y, m2 = x * xy - xx * y;
    const double determinant = n * m0 - x * m1 + y * m2;
    if (determinant < kLine * n * n * n) return w / n;
    return (w * m0 - xw * m1 + yw * m2) / determinant;
  }
};

}  // namespace

bool PixelGrid::fill(std::span<const Point> points, const CameraModel& camera, int step_px) {
  columns_ = rows_ = 0;
  if (!(camera.focal_px > 0) || step_px < 1 || points.size() > cell_.size()) return false;
  const auto pixel = [&](float across, float z, double centre) {
    return static_cast<int64_t>(std::lround((camera.focal_px * across / z + centre) / step_px));
  };
  int64_t columns = 0, rows = 0;
  for (const Point& p : points) {
    if (!(p.z > 0)) return false;
    const int64_t column = pixel(p.x, p.z, camera.cu_px), row = pixel(p.y, p.z, camera.cv_px);
    if (column < 0 || row < 0) return false;
    columns = std::max(columns, column + 1), rows = std::max(rows, row + 1);
    if (columns > static_cast<int64_t>(index_.size()) || rows > static_cast<int64_t>(index_.size())) return false;
  }
  if (columns * rows > static_cast<int64_t>(index_.size())) return false;
  columns_ = static_cast<int>(columns), rows_ = static_cast<int>(rows);
  std::fill_n(index_.begin(), cells(), kNone);
  for (uint32_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    cell_[i] = static_cast<uint32_t>(pixel(p.y, p.z, camera.cv_px) * columns + pixel(p.x, p.z, camera.cu_px));
    index_[cell_[i]] = static_cast<int32_t>(i);
  }
  return true;
}

std::span<const Point> SurfaceSmoother::run(const PixelGrid& grid, std::span<const Point> points,
                                            std::span<uint32_t> members, float step_m) {
  for (const uint32_t i : members) member_[i] = 1;
  size_t kept = 0;
  const size_t count = members.size();
  // Those that are dropped stay behind the kept ones, so that all can be unmarked below.
  for (size_t m = 0; m < count; ++m) {
    const uint32_t i = members[m];
    const Point& p = points[i];
    const int column = grid.column_of(i), row = grid.row_of(i);
    PlaneFit fit;
    for (int y = std::max(0, row - kHalfWindow); y <= std::min(grid.rows() - 1, row + kHalfWindow); ++y)
      for (int x = std::max(0, column - kHalfWindow); x <= std::min(grid.columns() - 1, column + kHalfWindow); ++x) {
        const int32_t k = grid.at(x, y);
        if (k == PixelGrid::kNone || member_[static_cast<size_t>(k)] == 0) continue;
        const float z = points[static_cast<size_t>(k)].z;
        if (std::abs(z - p.z) <= step_m) fit.add(x - column, y - row, 1.0 / static_cast<double>(z));
      }
    if (fit.n < kFewest) continue;
    const auto scale = static_cast<float>(1 / (fit.at_origin() * static_cast<double>(p.z)));
    smooth_[kept] = {p.x * scale, p.y * scale, p.z * scale};
    std::swap(members[kept++], members[m]);
  }
  for (const uint32_t i : members) member_[i] = 0;
  return std::span(smooth_).first(kept);
}

}  // namespace takt::object_3d
