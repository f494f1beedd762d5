// SPDX-License-Identifier: Apache-2.0
// Two-dimensional occupancy grid of what the scanner saw, around the robot (R-7.5, update; Elfes
// 1989).
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/mapping_3d/sliding_grid.hpp"
#include "nodes/scan_matching/scan_points.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::scan_matching {

constexpr int16_t kFree = 0, kOccupied = 1000, kUnknown = Grid::unknown;

struct OccupancyParameters {
  double cell_m = 0.10;
  double window_m = 30;      ///< side of the square around the robot, rounded up to an even number of cells
  double range_max_m = 15;   ///< beams are followed no farther; what ends there is not seen to be occupied
  int up = 200, down = 100;  ///< added where a beam ends, taken off where one passes; of 1000
};

/// Cells of the map frame, aligned with its axes. Allocates in the constructor only; one thread at a time.
class OccupancyMap {
 public:
  explicit OccupancyMap(const OccupancyParameters& parameters);

  /// Moves the window by whole cells so that the place lies in its middle; what comes in is unknown.
  void centre(double x_m, double y_m) { cells_.centre(x_m, y_m); }
  /// One sweep: unknown starts at 500, + up where a beam ends, - down where others pass, within 0..1000; a cell changes
  /// once a sweep. Beams without return tell nothing.
  void add(const PlanarPose& robot_in_map, const Sweep& sweep);
  /// Takes up a map that an earlier process gave, its first cell at (x, y). False if it is of another size.
  bool resume(ImageView<const int16_t> cells, double x_m, double y_m);

  int side() const { return cells_.side(); }
  double origin_x_m() const { return cells_.origin_x_m(); }
  double origin_y_m() const { return cells_.origin_y_m(); }
  ImageView<const int16_t> cells() const { return {cells_.cells().data(), side(), side()}; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, cells_); }

 private:
  struct Cell {
    int64_t column, row;  ///< of the window, or beyond
  };
  Cell cell_of(double x_m, double y_m) const;
  void observe(const Cell& cell, uint8_t what);
  void pass(const Cell& from, const Cell& to);

  OccupancyParameters p_;
  mapping_3d::SlidingGrid<int16_t> cells_;
  std::vector<uint8_t> observed_;  ///< by this sweep
  std::vector<size_t> touched_;
};

}  // namespace takt::scan_matching
