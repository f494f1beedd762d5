// SPDX-License-Identifier: Apache-2.0
// Where the robot can drive, from the heights that a tilted laser scanner sweeps.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/mapping_3d/sliding_grid.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::traversability {

constexpr int16_t kFree = 0, kBlocked = 1000, kUnknown = Grid::unknown;

struct HeightParameters {
  double cell_m = 0.15;
  double window_m = 12;               ///< side of the square around the robot, rounded up to an even number of cells
  double step_m = 0.05;               ///< higher or deeper ones block
  double slope = 0.268;               ///< steeper ones block; tangent, that of 15 degrees
  double robot_height_m = 1.78;       ///< higher points are no obstacles
  int points_min = 5;                 ///< a cell with fewer is unknown
  int64_t forget_ns = 5'000'000'000;  ///< a cell that was not seen for so long begins anew when it is seen again
};

/// What the points of one cell say.
struct Surface {
  bool known = false;
  double mean_m = 0, range_m = 0;  ///< of the heights
  double slope = 0;                ///< tangent of the plane that fits best; 0 where the points lie on a line
};

/// Cells of the map frame in a square that follows the robot. Allocates in the constructor only; one thread at a time.
class HeightMap {
 public:
  explicit HeightMap(const HeightParameters& parameters);
  /// From now on; cells and window stay as they were.
  void tune(HeightParameters parameters) {
    parameters.cell_m = p_.cell_m;
    parameters.window_m = p_.window_m;
    p_ = parameters;
  }

  /// Moves the window by whole cells so that the place lies in its middle; what comes in is unknown.
  void centre(double x_m, double y_m) { cells_.centre(x_m, y_m); }
  /// Points of the map frame, z above the floor that the robot stands on.
  void add(std::span<const mapping_3d::Position> points, int64_t stamp_ns);

  int side() const { return cells_.side(); }
  double cell_m() const { return p_.cell_m; }
  double origin_x_m() const { return cells_.origin_x_m(); }
  double origin_y_m() const { return cells_.origin_y_m(); }
  Surface surface(int column, int row) const;

  /// Blocked is a cell whose heights range over more than step_m, that is steeper than `slope`, or whose mean height
  /// differs from that of the next known cell in one of the four directions, at most two away, by more than step_m and
  /// than `slope` climbs on the way; up or down. `cells`: side() squared.
  void judge(ImageView<int16_t> cells) const;
  void remember(StateArchive& archive) { TAKT_STATE(archive, cells_); }

 private:
  /// Sums over points, places relative to the middle of the cell.
  struct Cell {
    double n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, low = 0, high = 0;
    int64_t seen_ns = 0;
  };
  bool blocked(const Surface& surface, int column, int row) const;

  HeightParameters p_;
  mapping_3d::SlidingGrid<Cell> cells_;
};

}  // namespace takt::traversability
