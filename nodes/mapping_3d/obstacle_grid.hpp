// SPDX-License-Identifier: Apache-2.0
// Obstacles around the robot from a point cloud (thesis Sec. 4.3.4; ).
// Robot frame: x right, y forward, z up, floor z = 0.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::mapping_3d {

struct ObstacleParameters {
  double voxel_m = 0.20;  ///< edge of a voxel and of a grid cell
  double robot_height_m = 1.78;
  double z_floor_m = 0.07;  ///< points less above the floor are floor and not counted
  double slope = 0.1763;    ///< the floor may rise or fall so steeply (tangent, that of 10 degrees);
                            ///< 0: it is z = 0 everywhere
  double share = 0.15;      ///< blocked: more points than this share of a fully covered face ...
  int n_abs = 5;            ///< ... and more than this
  double range_min_m = 0.8, range_max_m = 6.0;  ///< a free cell lies between
  double margin_m = 1.0;                        ///< the grid reaches range_max + margin to each side of the robot
  bool evidence = false;  ///< free only where the column holds at least one point (floor included)
};

/// A camera looks along its z axis and covers a face with points in rows and columns; a laser along its y axis, and a
/// sweep leaves one row.
enum class Sensor : uint8_t { camera, laser };

/// Where the cloud was seen from.
struct Viewpoint {
  Transform camera_in_robot;
  double focal_px = 0;       ///< in pixels that became points: of an image as fine as the cloud; points in a radian
  double half_view_rad = 0;  ///< half the horizontal angle of view
  Sensor sensor = Sensor::camera;
};

/// Size and place of a grid in the robot frame: the square of +-reach around the robot.
struct GridShape {
  int cells = 0;        ///< along each side
  double origin_m = 0;  ///< x and y of the lower corner of cell (0, 0)
  double cell_m = 0;

  /// The cell of a place; false if there is none (NaN as well).
  bool cell_of(double x_m, double y_m, int& column, int& row) const {
    const double inverse = 1 / cell_m, c = (x_m - origin_m) * inverse, r = (y_m - origin_m) * inverse;
    if (!(c >= 0 && c < cells && r >= 0 && r < cells)) return false;
    column = static_cast<int>(c);
    row = static_cast<int>(r);
    return true;
  }
};

constexpr int16_t kFree = 0, kOccupied = 1000, kUnknown = Grid::unknown;

/// Memory is taken by the constructor; fill() allocates nothing.
class ObstacleGrid {
 public:
  ObstacleGrid() = default;
  explicit ObstacleGrid(const ObstacleParameters& parameters);
  /// From the next fill() on; voxels, range_max_m and robot_height_m stay as they were.
  void tune(ObstacleParameters parameters);
  GridShape shape() const { return shape_; }

  /// Cells of the present cloud alone: kOccupied if a voxel of the column from the floor to the robot's height is
  /// blocked, kFree if none is and the cell is in view, else kUnknown. `points` in the sensor's frame (of a camera x
  /// right, y down, z forward; of a laser x right, y forward, z up); `cells` has shape().cells in both directions;
  /// column grows with x, row with y. The floor of a cell is the lowest that was seen there, if it follows from that of
  /// the cell before it on the way from the robot (or beside that one, if its floor was seen later) with no more than
  /// `slope`, and no more than z_floor at once; else it is that of the cell before. So a ramp is floor, and what lies
  /// behind a curb is not.
  void fill(std::span<const Point> points, const Viewpoint& viewpoint, ImageView<int16_t> cells);

  /// Whether a place in the robot frame lies in a voxel that the last fill() found blocked.
  bool blocked_at(double x_m, double y_m, double z_m) const;

 private:
  /// A cell, and the one before it on the straight way from the robot with those at its sides that are as near.
  struct Step {
    size_t cell = 0;
    std::array<size_t, 3> before{};
    double length_m = 0;
  };
  void plan_steps();
  void follow_floor(std::span<const Point> points, const Affine& camera);
  void count(std::span<const Point> points, const Affine& camera);
  bool mark_blocked(int column, int row, const Affine& camera, const Viewpoint& viewpoint);
  /// Layer of a voxel that an obstacle can block, from the height above the floor; -1 above, below and for the floor.
  int layer_of(double height_m) const;
  bool in_view(double x, double y, const Affine& camera, const Viewpoint& viewpoint) const;
  bool hidden(int column, int row, const Affine& camera, ImageView<int16_t> cells) const;
  size_t cell(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column);
  }
  size_t voxel(int column, int row, int layer) const {
    return cell(column, row) * static_cast<size_t>(layers_) + static_cast<size_t>(layer);
  }

  ObstacleParameters p_;
  GridShape shape_;
  int layers_ = 0;
  std::vector<uint32_t> counts_;  // per voxel, layers of a column side by side
  std::vector<uint8_t> blocked_;  // per voxel, of the last fill()
  std::vector<uint32_t> seen_;    // per column, floor and overhang included
  /// The lowest points of a column, and the floor that follows from them.
  struct Floor {
    double lowest_m = 0, sum_m = 0, height_m = 0;
    uint32_t points = 0, unseen = 0;  ///< unseen: cells since the last whose floor was seen
  };
  std::vector<Floor> floor_;
  std::vector<Step> steps_;  // nearest cells first
};

/// Adds a newer grid to an older one of the same shape: unknown yields to known, otherwise the maximum.
void merge(ImageView<const int16_t> newer, ImageView<int16_t> into);

}  // namespace takt::mapping_3d
