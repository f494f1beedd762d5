// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/rig.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "rt/msg/geometry.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using test::has;

namespace {

tl::expected<StereoRig, DeviceError> load(const std::string& yaml) {
  const test::TemporaryFolder folder;
  return load_rig("camera", folder.write("rig.yaml", yaml));
}
std::string message(const std::string& yaml) {
  const auto rig = load(yaml);
  return rig ? "" : rig.error().text();
}

}  // namespace

TEST_CASE("focal length follows from the field of view (oracle: 640 px and 66 deg -> 492.8 px)") {
  const auto rig = load("width: 640\nheight: 480\nhfov: 66deg\nbaseline: 24cm\n");
  REQUIRE(rig.has_value());
  CHECK(rig->focal_px == doctest::Approx(492.8).epsilon(1e-4));
  CHECK(rig->cu_px == 319.5);
  CHECK(rig->baseline_m == doctest::Approx(0.24));
  CHECK(rig->camera().focal_px == rig->focal_px);
}

TEST_CASE("mistakes in a rig name the line and the key") {
  CHECK(has(message("hfov: 66\nbaseline: 0.24m\n"), ":1: `hfov`"));
  CHECK(has(message("hfov: 66deg\n"), "`baseline` is missing"));
  CHECK(has(message("hfov: 66deg\nbaseline: 0.24m\nhfow: 3\n"), ":3: unknown key `hfow`"));
  CHECK(has(message("hfov: 66deg\nbaseline: -1m\n"), "positive"));
  CHECK(has(message("hfov: 66deg\nbaseline: .nan\n"), "`baseline`"));
  CHECK(has(message("hfov: 66deg\nbaseline: 0.1m\nwidth: 12.5\n"), "integer"));
  CHECK(has(message("hfov: 66deg\nbaseline: 0.1m\nmount: {x: 1}\n"), ":3: `x`"));
  CHECK(has(message("hfov: [\n"), "rig.yaml:"));
  CHECK(has(message("hfov: {a: 1}\nbaseline: 0.1m\n"), "`hfov`"));
  CHECK_FALSE(load_rig("camera", "/nonexistent.yaml").has_value());
}

TEST_CASE("an unrectified rig has no camera model") {
  const auto rig = load("hfov: 66deg\nbaseline: 0.24m\nrectified: false\ndistortion: [-0.1, 0, 0, 0, 0]\n");
  REQUIRE(rig.has_value());
  CHECK(rig->camera().focal_px == 0);
  CHECK(rig->distortion[0] == -0.1);
}

TEST_CASE("camera in robot: level camera looks along robot y; head angles count only on the head") {
  StereoRig rig;
  const Transform t = camera_in_robot(rig, 0.5, 0.1);
  CHECK(t.qw == doctest::Approx(std::sqrt(0.5)));
  CHECK(t.qx == doctest::Approx(-std::sqrt(0.5)));
  rig.on_head = true;
  CHECK(std::abs(camera_in_robot(rig, 0.5, 0.1).qz) > 0.1);
}
