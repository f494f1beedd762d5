// SPDX-License-Identifier: Apache-2.0
// Rooms and ways that the project makes itself, seen by a stereo camera, with ground truth for measurements and tests.
// World frame: x right, y ahead, z up.
#pragma once
#include <limits>
#include <vector>

#include "nodes/body_pose/ray_casting.hpp"
#include "nodes/cloud/cloud.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::mapping_3d {

using body_pose::Box;
using body_pose::Capsule;
using body_pose::Lot;

struct World {
  std::vector<Box> boxes;
  std::vector<Capsule> people;                                   ///< upright
  double ramp_from_m = std::numeric_limits<double>::infinity();  ///< the floor rises from this y on
  double ramp_slope = 0;

  double floor_m(double y_m) const { return y_m > ramp_from_m ? ramp_slope * (y_m - ramp_from_m) : 0; }
};

/// How far a place is from the nearest surface.
double distance_m(const World& world, const Eigen::Vector3d& place);

/// A closed room of 8 x 8 m around the origin, with boxes, tables and a shelf, that leaves a way free around the
/// middle.
World furnished_room(uint64_t seed);
/// What stands within sight of a place along an endless way, everywhere something else.
World long_way(double y_m, uint64_t seed);
/// A person with the feet there.
void add_person(World& world, double x_m, double y_m);
/// A table: its top 4 cm thick at 0.74 m, on four legs.
void add_table(World& world, double x_m, double y_m, double half_x_m, double half_y_m);

/// The narrow camera of the robot at a quarter of its size, its head tilted.
struct WorldCamera {
  int width = 160, height = 120, step_px = 4;
  double focal_px = 492.8, baseline_m = 0.24;  ///< at full size
  double height_m = 1.6, tilt_rad = -0.35;
  double noise_px = 0.2;   ///< standard deviation of a disparity
  double missing = 0.1;    ///< share of the pixels without one
  double wrong = 0.02;     ///< share of the pixels with any other
  double smeared = 0.3;    ///< share of the pixels at a step in depth with one between both sides
  double farthest_m = 12;  ///< nothing is measured beyond
  CameraModel model() const {
    return {focal_px, (width - 1) / 2.0 * step_px, (height - 1) / 2.0 * step_px, baseline_m};
  }
};

/// One look.
struct Look {
  Transform camera_in_world;
  std::vector<float> depth_m;  ///< of each pixel, exact; 0: nothing
  std::vector<Point> points;   ///< measured, camera frame
  std::vector<Colour> colours;
  std::vector<size_t> pixel;  ///< of each point
  cloud::CloudView cloud() const { return {points, colours}; }
};
Look look(const World& world, const WorldCamera& camera, const Transform& robot_in_world, Lot& lot);

/// The robot at a place, turned: 0 looks along y, counter-clockwise.
Transform robot_at(double x_m, double y_m, double heading_rad);
/// The same with an error of that size on each axis.
Transform disturbed(const Transform& pose, double sigma_m, double sigma_rad, Lot& lot);

}  // namespace takt::mapping_3d
