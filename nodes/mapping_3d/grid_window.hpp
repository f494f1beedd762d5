// SPDX-License-Identifier: Apache-2.0
// The last few views of the surroundings, and the grid that they make together. Each view was judged blocked, free or
// unknown from where it was seen, since the point density that tells an obstacle is that of its own camera; what is
// kept of it is the judgement, not the cloud.
#pragma once
#include <span>
#include <vector>

#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/state_archive.hpp"

namespace takt::mapping_3d {

/// Memory is taken by the constructor (0.5 MB a view at 70 x 70 cells); nothing else allocates. One thread at a time.
class GridWindow {
 public:
  GridWindow() = default;
  /// Of `views` (>= 1) views at most, the newest included.
  GridWindow(int views, const GridShape& shape);

  /// After grid.fill(points, viewpoint, cells): keeps this view as the newest; the oldest makes room. Its points in
  /// blocked voxels are reduced to their mean in each quarter of a cell (half a cell wide, half a cell deep).
  void keep(const ObstacleGrid& grid, std::span<const Point> points, const Viewpoint& viewpoint,
            const Transform& robot_in_map, ImageView<const int16_t> cells);

  /// Adds the older views to the newest one's `cells`, as `merge` does: each is gridded anew from the newest pose. A
  /// cell is occupied by a kept point in it, and free if its centre lies in a free cell of the old grid.
  void merge_older(ImageView<int16_t> cells);

  /// Takes a merged grid (row by row, `shape` of the constructor) as the newest view, for what an earlier process knew:
  /// its occupied cells stand for the points in them.
  void resume(std::span<const int16_t> cells, const Transform& robot_in_map);

  /// After the map frame has changed.
  void forget() { views_ = 0; }
  /// The views that there are.
  void remember(StateArchive& archive);

 private:
  struct View {
    Transform robot_in_map;
    std::vector<int16_t> cells;
    std::vector<Position> points;
    void remember(StateArchive& archive) { TAKT_STATE(archive, robot_in_map, cells, points); }
  };
  /// Sums of the points in one quarter of a cell, robot frame.
  struct Quarter {
    double x = 0, y = 0, z = 0;
    uint32_t points = 0;
  };
  void reduce(const ObstacleGrid& grid, std::span<const Point> points, const Viewpoint& viewpoint, View& view);
  void regrid(const View& old, const Transform& robot_in_map);

  GridShape shape_, quarters_;
  std::vector<View> ring_;
  std::vector<Quarter> sums_;
  std::vector<int16_t> regridded_;
  size_t newest_ = 0, views_ = 0;
};

}  // namespace takt::mapping_3d
