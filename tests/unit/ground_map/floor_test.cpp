// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "nodes/ground_map/floor_projection.hpp"
#include "nodes/ground_map/laser_check.hpp"
#include "nodes/ground_map/robot_track.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/testing.hpp"

using namespace takt;
using namespace takt::ground_map;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
const CameraModel kWide{283.1, 319.5, 239.5, 0.12};

}  // namespace

TEST_CASE("oracle 15: distances on the floor for a camera that looks down") {
  const auto distance = [](double tilt_deg, double below_centre_px) {
    const auto p = floor_projection(kWide, mapping_3d::camera_mount(0, 0, 1.6, 0, -tilt_deg * kDegree))
                       .floor_at(kWide.cu_px, kWide.cv_px + below_centre_px);
    REQUIRE(p.has_value());
    CHECK(p->x_m == doctest::Approx(0));
    return p->y_m;
  };
  CHECK(distance(10, 100) == doctest::Approx(2.83).epsilon(0.002));
  CHECK(distance(10, 50) == doctest::Approx(4.39).epsilon(0.002));
  CHECK(distance(20, 100) == doctest::Approx(1.94).epsilon(0.002));
}

TEST_CASE("for a pure tilt the homography is the formula of the thesis in its exact form") {
  const double h = 1.2, f = kWide.focal_px;
  for (const double tilt_deg : {0.0, 5.0, 25.0, 60.0}) {
    const double a = tilt_deg * kDegree;
    const FloorProjection projection = floor_projection(kWide, mapping_3d::camera_mount(-0.06, 0.25, h, 0, -a));
    for (int x = 0; x < 640; x += 37)
      for (int y = 0; y < 480; y += 23) {
        const double u = x - kWide.cu_px, v = y - kWide.cv_px;
        const double den = f * std::sin(a) + v * std::cos(a);
        const auto p = projection.floor_at(x, y);
        REQUIRE(p.has_value() == (den > f * FloorProjection::kHorizon));
        if (!p) continue;
        CHECK(p->y_m - 0.25 == doctest::Approx(h * (f * std::cos(a) - v * std::sin(a)) / den));
        CHECK(p->x_m + 0.06 == doctest::Approx(h * u / den));
        const auto back = projection.pixel_at(*p);
        REQUIRE(back.has_value());
        CHECK(back->x_px == doctest::Approx(x));
        CHECK(back->y_px == doctest::Approx(y));
      }
    CHECK_FALSE(projection.pixel_at({0, -500}).has_value());  // behind the camera
  }
}

TEST_CASE("yaw is that of Rz Rx Ry; a moved projection gives points of the map") {
  const Transform mount = mapping_3d::camera_mount(0, 0, 1, 0.3, -0.5);  // a pan of 0.3 turns about z
  const FloorProjection in_robot = floor_projection(kWide, mount);
  const PlanarPose pose{2, -3, 0.7};
  const auto here = in_robot.floor_at(300, 400), there = in_robot.moved(pose).floor_at(300, 400);
  const FloorPoint expected = transformed(pose, *here);
  CHECK(there->x_m == doctest::Approx(expected.x_m));
  CHECK(there->y_m == doctest::Approx(expected.y_m));
  CHECK(planar({1, 2, 3, std::cos(0.35), 0, 0, std::sin(0.35)}).theta_rad == doctest::Approx(0.7));
  // Rz(0.7) Rx(0.2): a pitching robot still heads to 0.7.
  const UncertainPose turn{{0, 0, 0, std::cos(0.35), 0, 0, std::sin(0.35)}, {}},
      pitch{{0, 0, 0, std::cos(0.1), std::sin(0.1), 0, 0}, {}};
  CHECK(planar(compose(turn, pitch).transform).theta_rad == doctest::Approx(0.7));
}

TEST_CASE("a laser return above the reference area means that something stands there") {
  const ReferenceArea area(640, 480, {});
  const FloorProjection projection =
      floor_projection(kWide, mapping_3d::camera_mount(-0.06, 0.25, 1.2, 0, -25 * kDegree));
  test::Box<LaserScan> scan({0, 0, 1, 181});
  scan->first_angle_rad = -90 * kDegree;
  scan->step_rad = kDegree;
  scan->max_range_m = 8;
  scan->sensor_in_robot = {0, 0.3, 0.25, 1, 0, 0, 0};
  scan->range_m.resize(181);
  for (float& range : scan->range_m.items()) range = 0;  // no return
  CHECK(area_is_free(*scan, projection, area));
  const auto seen = projection.floor_at(320, 420);  // in the middle of the area
  REQUIRE(seen.has_value());
  const auto straight = static_cast<float>(seen->y_m - 0.3);
  scan->range_m[90] = straight;
  CHECK_FALSE(area_is_free(*scan, projection, area));
  scan->range_m[90] = straight + 2;  // beyond
  CHECK(area_is_free(*scan, projection, area));
  scan->range_m[90] = 0;
  scan->range_m[180] = scan->range_m[0] = straight;  // to the left and right of the robot
  CHECK(area_is_free(*scan, projection, area));
  // Angles are counter-clockwise: from a scanner on the right the area lies to the left.
  scan->range_m[180] = scan->range_m[0] = 0;
  scan->sensor_in_robot.x = 1;
  const double angle = std::atan2(1 - seen->x_m, seen->y_m - 0.3);
  scan->first_angle_rad = angle;
  scan->range_m[0] = static_cast<float>(std::hypot(1 - seen->x_m, seen->y_m - 0.3));
  CHECK_FALSE(area_is_free(*scan, projection, area));
  scan->first_angle_rad = -angle;
  CHECK(area_is_free(*scan, projection, area));
}

TEST_CASE("odometry drives along the robot's y axis (C-9)") {
  Odometry odometry;
  odometry.x_m = 3;
  odometry.y_m = 4;
  odometry.theta_rad = 0.5;
  const PlanarPose pose = planar(mapping_3d::robot_in_odometry(odometry));
  const FloorPoint ahead = transformed(pose, {0, 1});
  CHECK(ahead.x_m - 3 == doctest::Approx(std::cos(0.5)));
  CHECK(ahead.y_m - 4 == doctest::Approx(std::sin(0.5)));
  const FloorPoint right = transformed(pose, {1, 0});
  CHECK(std::atan2(right.y_m - 4, right.x_m - 3) == doctest::Approx(0.5 - std::numbers::pi / 2));
}

TEST_CASE("poses between two, predicted after the last, and none where nothing is known") {
  RobotTrack track(16);
  CHECK_FALSE(track.at(0).has_value());
  CHECK_FALSE(track.predicted(0).has_value());
  const auto at_y = [](double y) { return Transform{0, y, 0, 1, 0, 0, 0}; };
  track.insert(100'000'000, at_y(1));
  CHECK_FALSE(track.predicted(150'000'000).has_value());  // one pose says nothing about motion
  track.insert(200'000'000, at_y(2));
  track.insert(100'000'000, at_y(1));  // latched again
  CHECK(track.at(150'000'000)->y == doctest::Approx(1.5));
  CHECK_FALSE(track.at(250'000'000).has_value());
  CHECK(track.predicted(250'000'000)->y == doctest::Approx(2.5));
  CHECK_FALSE(track.predicted(800'000'000).has_value());
  CHECK_FALSE(track.predicted(150'000'000).has_value());
}
