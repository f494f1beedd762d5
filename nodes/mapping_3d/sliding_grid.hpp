// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/state_archive.hpp"

namespace takt::mapping_3d {

/// Cells of the plane in a square window that follows the robot by whole cells. Column and row count from the window's
/// corner. Allocates in the constructor only; one thread at a time.
template <class Cell>
class SlidingGrid {
 public:
  /// `side_m` is rounded up to an even number of cells; a cell that has not been in the window is `unknown`. At first
  /// the origin of the plane lies in the middle.
  SlidingGrid(double side_m, double cell_m, const Cell& unknown)
      : cell_m_(cell_m),
        unknown_(unknown),
        side_(2 * static_cast<int>(std::ceil(side_m / 2 / cell_m - 1e-9))),
        first_column_(-side_ / 2),
        first_row_(-side_ / 2),
        cells_(static_cast<size_t>(side_) * static_cast<size_t>(side_), unknown),
        moved_(cells_.size(), unknown) {}

  /// Moves the window so that the place lies in its middle; what comes in is unknown.
  void centre(double x_m, double y_m) {
    const int64_t right = column_of(x_m) - side_ / 2, up = row_of(y_m) - side_ / 2;
    if (right == 0 && up == 0) return;
    first_column_ += right;
    first_row_ += up;
    std::fill(moved_.begin(), moved_.end(), unknown_);
    const int64_t first = std::max<int64_t>(0, -right), last = std::min<int64_t>(side_, side_ - right);
    for (int64_t row = std::max<int64_t>(0, -up); first < last && row < std::min<int64_t>(side_, side_ - up); ++row)
      std::copy_n(cells_.begin() + (row + up) * side_ + first + right, last - first,
                  moved_.begin() + row * side_ + first);
    cells_.swap(moved_);
  }
  /// The cells stay, their corner becomes the one nearest to the place.
  void lay_at(double x_m, double y_m) {
    first_column_ = std::llround(x_m / cell_m_);
    first_row_ = std::llround(y_m / cell_m_);
  }

  int side() const { return side_; }
  double cell_m() const { return cell_m_; }
  double origin_x_m() const { return static_cast<double>(first_column_) * cell_m_; }
  double origin_y_m() const { return static_cast<double>(first_row_) * cell_m_; }

  /// Of the cell that a coordinate lies in, which may be outside.
  int64_t column_of(double x_m) const { return static_cast<int64_t>(std::floor(x_m / cell_m_)) - first_column_; }
  int64_t row_of(double y_m) const { return static_cast<int64_t>(std::floor(y_m / cell_m_)) - first_row_; }
  bool contains(int64_t column, int64_t row) const {
    return std::min(column, row) >= 0 && std::max(column, row) < side_;
  }
  /// Of cells().
  size_t index(int64_t column, int64_t row) const { return static_cast<size_t>(row * side_ + column); }
  Cell& at(int64_t column, int64_t row) { return cells_[index(column, row)]; }
  const Cell& at(int64_t column, int64_t row) const { return cells_[index(column, row)]; }
  std::span<Cell> cells() { return cells_; }
  std::span<const Cell> cells() const { return cells_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, first_column_, first_row_, cells_); }

 private:
  double cell_m_;
  Cell unknown_;
  int side_;
  int64_t first_column_, first_row_;  ///< of the plane
  std::vector<Cell> cells_, moved_;
};

}  // namespace takt::mapping_3d
