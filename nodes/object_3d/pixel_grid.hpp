// SPDX-License-Identifier: Apache-2.0
// The points of a camera's cloud by the pixels that they were triangulated from.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

class PixelGrid {
 public:
  static constexpr int32_t kNone = -1;

  /// Takes the memory for grids of up to `cells` cells and as many points; nothing else allocates.
  explicit PixelGrid(size_t cells) : index_(cells), cell_(cells) {}

  /// Points in the frame of the camera (z forward), one per step x step pixels. False, and the grid empty, where that
  /// cannot be: a cloud of no camera, a point behind it, more pixels than cells.
  bool fill(std::span<const Point> points, const CameraModel& camera, int step_px);

  bool empty() const { return columns_ == 0; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  size_t cells() const { return static_cast<size_t>(columns_) * static_cast<size_t>(rows_); }
  /// Index of the point of a cell, or kNone.
  int32_t at(int column, int row) const { return index_[static_cast<size_t>(row * columns_ + column)]; }
  int column_of(uint32_t point) const { return static_cast<int>(cell_[point]) % columns_; }
  int row_of(uint32_t point) const { return static_cast<int>(cell_[point]) / columns_; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<int32_t> index_;
  std::vector<uint32_t> cell_;
};

/// Takes the noise of stereo out of a surface. Noise moves a point along its ray; a plane is linear in 1 / z over the
/// pixels. So each point goes, on its ray, to where the plane through its neighbours crosses it.
class SurfaceSmoother {
 public:
  explicit SurfaceSmoother(size_t capacity) : member_(capacity), smooth_(capacity) {}

  /// `points` in the frame of the camera, as the grid was filled with. For each of `members` the smoothed point; the
  /// window is that of the 5 x 5 cells around it, members alone, no farther from it in z than `step_m`. A point with
  /// fewer than kFewest in its window belongs to no surface and is dropped. Returns the points kept and, in the same
  /// order, moves their indices to the front of `members`.
  std::span<const Point> run(const PixelGrid& grid, std::span<const Point> points, std::span<uint32_t> members,
                             float step_m);
  static constexpr int kFewest = 8;

 private:
  std::vector<uint8_t> member_;
  std::vector<Point> smooth_;
};

}  // namespace takt::object_3d
