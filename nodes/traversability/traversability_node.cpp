// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "nodes/mapping_3d/map_grid.hpp"
#include "nodes/traversability/height_map.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace traversability;
using mapping_3d::Position;

class TraversabilityNode final : public Node {
 public:
  void setup(Setup&) override {
    heights_.emplace(parameters());
    points_.reserve(scan_.capacity().count);
    const auto side = static_cast<uint32_t>(heights_->side());
    driveable_.reserve({side, side, 1, 0});
    fused_.reserve({side, side, 1, 0});
  }

  void changed() override { heights_->tune(parameters()); }

  void run(Job& job) override {
    for (size_t i = 0; i < odometry_.size(); ++i)
      track_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    const int64_t before_ns = last_stamp_ns_;
    for (size_t i = 0; i < scan_.size(); ++i) add(i);
    if (last_stamp_ns_ == before_ns || !give(driveable_, false) || !give(fused_, true)) job.no_result();
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, heights_, track_, last_stamp_ns_); }

 private:
  HeightParameters parameters() const {
    HeightParameters p;
    p.cell_m = cell_;
    p.window_m = window_;
    p.step_m = step_;
    p.slope = std::tan(slope_());
    p.robot_height_m = robot_height_;
    p.points_min = points_min_;
    p.forget_ns = std::llround(forget_() * 1e9);
    return p;
  }

  /// A scan counts once the odometry is known at its stamp.
  void add(size_t i) {
    if (scan_.stamp_ns(i) <= last_stamp_ns_) return;
    const auto robot = track_.at(scan_.stamp_ns(i));
    if (!robot) return;
    last_stamp_ns_ = scan_.stamp_ns(i);
    const LaserScan& scan = scan_[i];
    const mapping_3d::Affine to_map =
        mapping_3d::to_affine(compose(*robot, UncertainPose{scan.sensor_in_robot, {}}).transform);
    points_.clear();
    for (uint32_t beam = 0; beam < scan.range_m.size; ++beam) {
      const double range = scan.range_m[beam];
      if (!(range > 0) || range > range_max_) continue;
      const double angle = scan.first_angle_rad + beam * scan.step_rad;  // counter-clockwise from the forward axis y
      points_.push_back(transformed(to_map, -range * std::sin(angle), range * std::cos(angle), 0));
    }
    heights_->centre(robot->transform.x, robot->transform.y);
    heights_->add(points_, last_stamp_ns_);
  }

  /// False if no memory was to be had.
  bool give(Output<Grid>& port, bool with_other) {
    if (!port.connected()) return true;
    Grid* out = port.loan();
    const auto side = static_cast<size_t>(heights_->side());
    if (!out || !out->cells.resize(side * side)) return false;
    out->width = out->height = heights_->side();
    out->cell_m = heights_->cell_m();
    const double half_m = out->width / 2.0 * out->cell_m;
    out->origin_x_m = out->origin_y_m = -half_m;
    out->grid_in_map = {};
    out->grid_in_map.x = heights_->origin_x_m() + half_m;
    out->grid_in_map.y = heights_->origin_y_m() + half_m;
    heights_->judge(out->view());
    const Grid* other = grid_.newest();
    if (with_other && other) fuse(mapping_3d::view_of(*other), *out);
    port.send(last_stamp_ns_);
    return true;
  }

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses of the odometry

  Input<LaserScan> scan_{this, "scan", "sweeps of a scanner tilted to the floor; depth 4"};
  Input<Odometry> odometry_{this, "odometry", "the robot's poses around the scans' stamps; depth 16"};
  Input<Grid> grid_{this, "grid", "what else is known of the same map frame, for `fused`", Need::optional};
  Output<Grid> driveable_{this, "traversability",
                          "cells of the map frame around the robot: 0 can be driven on, 1000 not"};
  Output<Grid> fused_{this, "fused", "the same with `grid`: unknown yields to known, otherwise the larger counts"};

  Param<double> cell_{this, "cell", 0.15, {0.05, 1.0}, "m", "edge of a cell", kSizesMemory};
  Param<double> window_{this, "window", 12.0, {1.0, 60.0}, "m", "side of the grid", kSizesMemory};
  Param<double> step_{this, "step", 0.05, {0.005, 1.0}, "m", "higher or deeper steps block"};
  Param<double> slope_{this, "slope", 0.2618, {0.01, 1.5}, "rad", "steeper slopes block"};
  Param<double> robot_height_{this, "robot_height", 1.78, {0.1, 5.0}, "m", "higher points are no obstacles"};
  Param<double> range_max_{this, "range_max", 5.0, {0.5, 80.0}, "m", "farther returns are not used"};
  Param<int> points_min_{this, "points_min", 5, {3, 10000}, "", "fewest points of a known cell"};
  Param<double> forget_{this, "forget", 5.0, {0.1, 3600.0}, "s", "a cell unseen for so long begins anew"};

  std::optional<HeightMap> heights_;
  std::vector<Position> points_;
  PoseTrack track_{InputPort::kMaxDepth, kLongestGapNs};
  int64_t last_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_traversability(NodeTypes& types) {
  types.add<TraversabilityNode>("traversability", Layer::perception, "Where a tilted laser scanner says one can drive");
}

}  // namespace takt
