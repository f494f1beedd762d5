// SPDX-License-Identifier: Apache-2.0
// How well a return at some place agrees with the mapped points (Olson, "Real-time correlative scan matching", 2009),
// at two resolutions.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/scan_matching/scan_points.hpp"

namespace takt::scan_matching {

/// A square of cells of the map frame, aligned with its axes. A cell's value is 255 exp(-d^2 / 2 sigma^2), rounded, d
/// the distance in cells from the nearest cell with a mapped point, and 0 beyond 3 sigma. Allocates in the constructor
/// only.
class ScoreField {
 public:
  static constexpr int kBlock = 8;  ///< cells along the edge of a block

  /// half_m: from the middle to each side, rounded up to whole blocks.
  ScoreField(double half_m, double cell_m, double sigma_m);

  /// Draws the points anew, with (x, y) in the middle. Points nearer than 3 sigma to the edge are left out.
  void draw(std::span<const SurfacePoint> points, double x_m, double y_m);

  int cells() const { return cells_; }
  double cell_m() const { return cell_m_; }
  int column(double x_m) const { return static_cast<int>(std::floor((x_m - x0_m_) / cell_m_)); }
  int row(double y_m) const { return static_cast<int>(std::floor((y_m - y0_m_) / cell_m_)); }
  /// 0 <= column, row < cells().
  uint8_t at(int column, int row) const { return *cell(column, row); }
  const uint8_t* cell(int column, int row) const { return &values_[index(cells_, column, row)]; }
  /// Not less than the value of any cell of the two by two blocks of which (column, row) / kBlock is the first.
  uint8_t bound(int column, int row) const { return bounds_[index(blocks_, column / kBlock, row / kBlock)]; }

 private:
  static size_t index(int width, int column, int row) {
    return static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column);
  }
  void find_bounds();

  double cell_m_;
  int blocks_, cells_, radius_;
  double x0_m_ = 0, y0_m_ = 0;
  std::vector<uint8_t> kernel_;  ///< 2 radius + 1 in both directions
  std::vector<uint8_t> values_, bounds_, highest_;
};

}  // namespace takt::scan_matching
