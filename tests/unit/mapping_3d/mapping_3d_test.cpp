// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/node.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt {
void register_mapping_3d(NodeTypes& types);
}

using namespace takt::mapping_3d;
using takt::Point;
using takt::Transform;

namespace {

constexpr double kFocal = 492.8;

/// Points of one image of a scene given as depth along the ray (0: none), by casting one ray a pixel.
template <class Scene>
std::vector<Point> look(const Transform& mount, int step, Scene&& range) {
  std::vector<Point> points;
  const Affine m = to_affine(mount);
  for (int v = 0; v < 480; v += step)
    for (int u = 0; u < 640; u += step) {
      const double ray[3] = {(u - 319.5) / kFocal, (v - 239.5) / kFocal, 1};
      double d[3];
      for (int i = 0; i < 3; ++i) d[i] = m.r[3 * i] * ray[0] + m.r[3 * i + 1] * ray[1] + m.r[3 * i + 2];
      const double t = range(m.t, d);
      if (t > 0)
        points.push_back({static_cast<float>(ray[0] * t), static_cast<float>(ray[1] * t), static_cast<float>(t)});
    }
  return points;
}

double floor_hit(const double* from, const double* d) { return d[2] < -1e-6 ? -from[2] / d[2] : 0; }

/// A horizontal board at height 0.75 m, x -0.5..0.5, y 2.5..3.5.
double table_hit(const double* from, const double* d) {
  const double t = d[2] < -1e-6 ? (0.75 - from[2]) / d[2] : 0;
  const double x = from[0] + t * d[0], y = from[1] + t * d[1];
  return t > 0 && std::abs(x) < 0.5 && y > 2.5 && y < 3.5 ? t : 0;
}

struct Fixture {
  ObstacleGrid grid;
  std::vector<int16_t> cells;
  Viewpoint viewpoint{camera_mount(0, 0, 1.6, 0, -0.3), kFocal, std::atan(320 / kFocal)};

  explicit Fixture(const ObstacleParameters& p = {}) : grid(p) {
    cells.resize(static_cast<size_t>(grid.shape().cells) * static_cast<size_t>(grid.shape().cells));
  }
  takt::ImageView<int16_t> view() { return {cells.data(), grid.shape().cells, grid.shape().cells}; }
  int at(double x, double y) {
    const GridShape s = grid.shape();
    return view().at(static_cast<int>(std::floor((x - s.origin_m) / s.cell_m)),
                     static_cast<int>(std::floor((y - s.origin_m) / s.cell_m)));
  }
};

}  // namespace

TEST_CASE("oracle 18: table top over free floor is occupied, floor alone is free, the unseen is unknown") {
  Fixture f;
  const auto& mount = f.viewpoint.camera_in_robot;
  f.grid.fill(look(mount, 1, floor_hit), f.viewpoint, f.view());
  CHECK(f.at(0, 3.1) == kFree);
  CHECK(f.at(0.5, 2.1) == kFree);
  CHECK(f.at(0, -2) == kUnknown);     // behind
  CHECK(f.at(3, 1) == kUnknown);      // beside the view
  CHECK(f.at(0.1, 6.9) == kUnknown);  // beyond the range
  CHECK(f.at(0.1, 0.5) == kUnknown);  // too near
  const auto both = [](const double* from, const double* d) {
    return table_hit(from, d) > 0 ? table_hit(from, d) : floor_hit(from, d);
  };
  f.grid.fill(look(mount, 1, both), f.viewpoint, f.view());
  CHECK(f.at(0, 3.1) == kOccupied);
  CHECK(f.at(0, 1.9) == kFree);
  CHECK(f.at(0.1, 5.1) == kUnknown);  // hidden behind the table
  CHECK(f.at(1.7, 4.1) == kFree);     // beside it
}

TEST_CASE("the threshold follows the subsampling of the cloud") {
  ObstacleParameters p;
  p.n_abs = 2;
  Fixture coarse(p), wrong;
  coarse.viewpoint.focal_px /= 4;
  const auto both = [](const double* from, const double* d) {
    return table_hit(from, d) > 0 ? table_hit(from, d) : floor_hit(from, d);
  };
  const auto points = look(coarse.viewpoint.camera_in_robot, 4, both);
  coarse.grid.fill(points, coarse.viewpoint, coarse.view());
  wrong.grid.fill(points, wrong.viewpoint, wrong.view());
  CHECK(coarse.at(0, 3.1) == kOccupied);
  CHECK(wrong.at(0, 3.1) == kFree);  // a full-resolution threshold misses it
}

TEST_CASE("a few stray points block nothing; a beam above the robot neither; a low one does") {
  struct Stray {
    double height;
    int points, expected;
  };
  for (const Stray& stray : {Stray{1.0, 5, kFree}, {1.0, 400, kOccupied}, {1.9, 400, kFree}, {0.03, 400, kFree}}) {
    CAPTURE(stray.height);
    CAPTURE(stray.points);
    Fixture f;
    // In the camera frame by the inverse mount.
    const Affine to_camera = to_affine(takt::inverse(takt::UncertainPose{f.viewpoint.camera_in_robot, {}}).transform);
    const double r[3] = {0.1, 4.1, stray.height};
    Point p;
    float* out[3] = {&p.x, &p.y, &p.z};
    for (int i = 0; i < 3; ++i)
      *out[i] = static_cast<float>(to_camera.r[3 * i] * r[0] + to_camera.r[3 * i + 1] * r[1] +
                                   to_camera.r[3 * i + 2] * r[2] + to_camera.t[i]);
    f.grid.fill(std::vector<Point>(static_cast<size_t>(stray.points), p), f.viewpoint, f.view());
    CHECK(f.at(0.1, 4.1) == stray.expected);
  }
}

TEST_CASE("with evidence a cell without any point stays unknown") {
  ObstacleParameters p;
  p.evidence = true;
  Fixture f(p);
  f.grid.fill({}, f.viewpoint, f.view());
  CHECK(f.at(0, 3.1) == kUnknown);
  f.grid.fill(look(f.viewpoint.camera_in_robot, 1, floor_hit), f.viewpoint, f.view());
  CHECK(f.at(0, 3.1) == kFree);
}

TEST_CASE("camera mount: forward is robot y, down is -z; tilt up lifts the axis, pan left turns it to -x") {
  const auto axis = [](const Transform& t) {
    const Affine m = to_affine(t);
    return std::array{m.r[2], m.r[5], m.r[8]};
  };
  const Affine level = to_affine(camera_mount(0.1, 0.2, 1.5, 0, 0));
  const double expected[9] = {1, 0, 0, 0, 0, 1, 0, -1, 0};
  for (int i = 0; i < 9; ++i) CHECK(level.r[i] == doctest::Approx(expected[i]));
  CHECK(level.t[2] == 1.5);
  CHECK(axis(camera_mount(0, 0, 0, 0, 0.3))[2] == doctest::Approx(std::sin(0.3)));
  CHECK(axis(camera_mount(0, 0, 0, 0.3, 0))[0] == doctest::Approx(-std::sin(0.3)));
}

TEST_CASE("the head's pan and tilt add to those of the camera at rest") {
  for (const double pan : {-0.8, 0.0, 0.5})
    for (const double tilt : {-0.4, 0.0, 0.2}) {
      const Transform turned = turned_by_head(camera_mount(0.1, 0.2, 1.4, 0.3, -0.3), pan, tilt);
      const Transform expected = camera_mount(0.1, 0.2, 1.4, 0.3 + pan, -0.3 + tilt);
      const double same =
          turned.qw * expected.qw + turned.qx * expected.qx + turned.qy * expected.qy + turned.qz * expected.qz;
      CHECK(std::abs(same) == doctest::Approx(1).epsilon(1e-12));
      CHECK(turned.x == 0.1);
      CHECK(turned.z == 1.4);
    }
}

TEST_CASE("a laser looks along y, and one sweep leaves one row of points: enough of it blocks") {
  Fixture f;
  f.viewpoint = {{0, 0, 0.25, 1, 0, 0, 0}, 1 / 0.0087, 1.57, Sensor::laser};
  std::vector<Point> wall;
  for (int beam = 0; beam < 361; ++beam) {
    const double angle = (beam - 180) * 0.0087, range = 3.1 / std::cos(angle);  // a wall across, 3.1 m ahead
    if (std::abs(angle) < 0.6)
      wall.push_back({static_cast<float>(-range * std::sin(angle)), static_cast<float>(range * std::cos(angle)), 0});
  }
  f.grid.fill(wall, f.viewpoint, f.view());
  CHECK(f.at(0.1, 3.1) == kOccupied);
  CHECK(f.at(1.1, 3.1) == kOccupied);
  CHECK(f.at(0.1, 2.1) == kFree);
  CHECK(f.at(-3.1, 1.1) == kFree);
  CHECK(f.at(0.1, 4.1) == kUnknown);   // behind
  CHECK(f.at(0.1, -1.1) == kUnknown);  // not in view
}

TEST_CASE("merge: unknown yields to known, otherwise the maximum") {
  std::vector<int16_t> into{-1, -1, 0, 1000}, newer{-1, 0, 1000, 0};
  merge({newer.data(), 2, 2}, {into.data(), 2, 2});
  CHECK(into == std::vector<int16_t>{-1, 0, 1000, 1000});
}

TEST_CASE("the node type registers with its ports") {
  takt::NodeTypes types;
  takt::register_mapping_3d(types);
  const auto* type = types.find("mapping_3d");
  REQUIRE(type);
  const auto node = type->make();
  REQUIRE(node->inputs().size() == 7);
  CHECK(node->inputs()[0]->name() == "cloud");
  CHECK(node->inputs()[1]->name() == "motion");
  CHECK(node->inputs()[2]->name() == "odometry");
  CHECK(node->outputs()[0]->name() == "obstacles");
}
