// SPDX-License-Identifier: Apache-2.0
#include "nodes/head_behaviour/gaze.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "rt/msg/geometry.hpp"

using namespace takt;
using namespace takt::head_behaviour;
using mapping_3d::Position;

namespace {

constexpr int64_t kSecond = 1'000'000'000;
const Transform kMount = mapping_3d::camera_mount(-0.12, 0.15, 1.4, 0.2, -0.26);

}  // namespace

TEST_CASE("with the angles towards a place it lies on the optical axis") {
  for (const Position& place :
       {Position{0, 2, 1.7}, Position{-1.5, 1, 1.2}, Position{2, -1, 0.3}, Position{-0.5, -2, 2}}) {
    const auto angles = angles_towards(kMount, place);
    const auto camera = mapping_3d::to_affine(mapping_3d::turned_by_head(kMount, angles.pan_rad, angles.tilt_rad));
    const double dx = place.x_m - camera.t[0], dy = place.y_m - camera.t[1], dz = place.z_m - camera.t[2];
    const double range = std::hypot(dx, dy, dz);
    CHECK(dx / range == doctest::Approx(camera.r[2]));
    CHECK(dy / range == doctest::Approx(camera.r[5]));
    CHECK(dz / range == doctest::Approx(camera.r[8]));
    CHECK(std::abs(angles.pan_rad) <= 3.1416);
  }
}

TEST_CASE("the partner is the nearest who came near, stays it until he leaves, and may be unseen for a while") {
  Gaze gaze({});
  const Position far{0, 4, 1.7}, left{-1, 2, 1.7}, right{1.5, 2, 1.6};
  gaze.see(std::array{far}, 0);
  CHECK_FALSE(gaze.partner());
  gaze.see(std::array{far, right, left}, kSecond);
  REQUIRE(gaze.partner());
  CHECK(gaze.partner()->x_m == -1);
  gaze.see(std::array{Position{0.3, 1, 1.7}, Position{-1.2, 2.4, 1.7}}, 2 * kSecond);  // somebody comes nearer
  CHECK(gaze.partner()->x_m == -1.2);
  gaze.see(std::array{Position{0.3, 1, 1.7}}, 3 * kSecond);  // he is hidden
  CHECK(gaze.partner()->x_m == -1.2);
  gaze.see(std::array{Position{0.3, 1, 1.7}}, 4 * kSecond);
  CHECK_FALSE(gaze.partner());
  gaze.see(std::array{Position{0.3, 1, 1.7}}, 4 * kSecond);
  CHECK(gaze.partner()->x_m == 0.3);
  for (double y = 1; y < 3.5; y += 0.4) gaze.see(std::array{Position{0.3, y, 1.7}}, 5 * kSecond);
  CHECK(gaze.partner()->y_m == doctest::Approx(3.4));
  gaze.see(std::array{Position{0.3, 3.6, 1.7}}, 5 * kSecond);
  CHECK_FALSE(gaze.partner());
}

TEST_CASE("the head looks at the partner within its limits, stands still for small steps, and returns") {
  GazeParameters parameters;
  parameters.pan_max_rad = 1;
  Gaze gaze(parameters);
  const Transform camera = mapping_3d::camera_mount(0, 0, 1.5, 0, 0);
  CHECK(gaze.look(camera).pan_rad == 0);
  gaze.see(std::array{Position{-1, 2, 1.5}}, 0);
  const double pan = gaze.look(camera).pan_rad;
  CHECK(pan == doctest::Approx(std::atan2(1, 2)));
  CHECK(gaze.look(camera).tilt_rad == doctest::Approx(0));
  gaze.see(std::array{Position{-1.05, 2, 1.5}}, 1);
  CHECK(gaze.look(camera).pan_rad == pan);
  gaze.see(std::array{Position{-1.3, 2, 1.5}}, 2);
  CHECK(gaze.look(camera).pan_rad == doctest::Approx(std::atan2(1.3, 2)));
  for (double y = 2; y > 0; y -= 0.5) gaze.see(std::array{Position{-1.3, y, 1.5}}, 3);
  CHECK(gaze.look(camera).pan_rad == 1);
  gaze.wait(2 * kSecond);
  CHECK(gaze.look(camera).pan_rad == 0);
}
