// SPDX-License-Identifier: Apache-2.0
// Scanners whose mounts are known sweep a room that is known; what is found must be these mounts.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "nodes/calibration/generated_sweeps.hpp"
#include "nodes/calibration/picture.hpp"
#include "nodes/laser_fusion/evaluate.hpp"
#include "rt/msg/point.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::calibration;
using namespace takt::laser_fusion;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr GeneratedSweepParameters kFew{.noise_m = 0.001, .headings = 240, .beams = 181};

/// Returns from heights 0 .. height_m of an object, evenly spaced, 0.8 to 1.2 m ahead in the scanner's plane.
LaserSweep object_sweep(const PoseParameters& mount, double height_m, int returns) {
  const Rigid pose = to_rigid(mount);
  LaserSweep sweep{"one", mount, {}};
  for (int i = 0; i < returns; ++i) {
    const double z = height_m * i / (returns - 1.0), ahead = 0.8 + 0.1 * (i % 5);
    const double across = (z - pose.t.z() - pose.R(2, 1) * ahead) / pose.R(2, 0);
    sweep.returns.push_back({0.01 * (i % 7), std::atan2(-across, ahead), std::hypot(across, ahead), true});
  }
  return sweep;
}

std::string refusal(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  try {
    read_laser_recording(file);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("height and roll come back to within eps, whatever sign the roll has and from wherever it starts") {
  for (const double roll : {45.0, -45.0, 30.0, -70.0})
    for (const double off : {-1.0, 1.0}) {
      const PoseParameters truth{0.2, 0.1, 0.93, 0.05, 0.03, roll * kDegree};
      const LaserSweep sweep = object_sweep(truth, 1.2, 1001);
      PoseParameters start = truth;
      start[kZ] += 0.08 * off;
      start[kRoll] -= 6 * kDegree * off;
      const HeightFit fit = fit_height(sweep, start, 1.2, {});
      CHECK(fit.converged);
      CHECK(std::abs(fit.bottom_m) <= 1e-4);
      CHECK(std::abs(fit.height_error_m) <= 1e-4);
      CHECK(std::abs(fit.z_m - truth[kZ]) < 3e-4);
      CHECK(std::abs(fit.roll_rad - truth[kRoll]) < 3e-4);
    }
}

TEST_CASE("a few returns beside the object do not move its ends") {
  const PoseParameters truth{0, 0, 0.9, 0, 0, 45 * kDegree};
  LaserSweep sweep = object_sweep(truth, 1.2, 2001);
  for (int i = 0; i < 4; ++i) sweep.returns.push_back({0, (i % 2 == 0 ? -1 : 1) * 80 * kDegree, 4, true});
  const HeightFit fit = fit_height(sweep, truth, 1.2, {});
  CHECK(fit.converged);
  CHECK(std::abs(fit.z_m - truth[kZ]) < 0.003);
  CHECK(std::abs(fit.roll_rad - truth[kRoll]) < 0.003);
}

TEST_CASE("an object that cannot have that height is told, and one that nobody has seen") {
  const PoseParameters truth{0, 0, 0.9, 0, 0, 45 * kDegree};
  CHECK_FALSE(fit_height(object_sweep(truth, 1.2, 1001), truth, 40, {}).converged);
  CHECK_THROWS_AS(fit_height({"none", truth, {}}, truth, 1.2, {}), std::invalid_argument);
}

TEST_CASE("a mount is judged by every return's nearest point of the room, and its pairs lead to the mount") {
  const GeneratedSweeps generated = generate_sweeps({.noise_m = 0, .headings = 60, .beams = 61}, 2);
  const LaserSweep &room = generated.recording.sweeps[0], &sweep = generated.recording.sweeps[1];
  const Rigid room_mount = to_rigid(generated.truth[0]), mount = to_rigid(generated.truth[1]);
  SweepMatcher matcher(room, room_mount, sweep, {100'000, 100'000, 0.25});
  CHECK(matcher.returns() == sweep.returns.size());

  const std::vector<Point> points = in_room(room, room_mount), places = in_room(sweep, mount);
  double sum_m = 0;
  size_t pairs = 0;
  for (const Point& place : places) {
    const double distance_m = std::sqrt(nearest_reference(points, place).distance2);
    sum_m += std::min(distance_m, 0.25);
    pairs += distance_m <= 0.25;
  }
  const Quality quality = matcher.evaluate(mount);
  CHECK(quality.score == doctest::Approx(sum_m / static_cast<double>(places.size())).epsilon(1e-3));
  CHECK(std::abs(static_cast<double>(quality.pairs) - static_cast<double>(pairs)) < 4);  // on the verge

  // A sweep against itself: the fit of the pairs is the mount, wherever the robot was heading.
  SweepMatcher itself(room, room_mount, room, {100'000, 100'000, 0.25});
  CHECK(itself.evaluate(room_mount).score < 1e-5);
  CHECK(error_of(fit_rigid(itself.pairs()), room_mount).m < 1e-4);
  CHECK(error_of(fit_rigid(itself.pairs()), room_mount).rad < 1e-4);
}

TEST_CASE("patches are the flat cubes of a room; exact ones lead to the exact mount in a few steps") {
  std::vector<Point> floor_and_corner;
  for (int i = 0; i < 20; ++i)
    for (int k = 0; k < 20; ++k) {
      const float a = 0.01f * static_cast<float>(i), b = 0.01f * static_cast<float>(k);
      floor_and_corner.push_back({a, b, 0});
      floor_and_corner.push_back(i < 10 ? Point{1 + a, b, 0.5f} : Point{1.1f, b, 0.5f + a});  // an edge
      if (i == 0) floor_and_corner.push_back({a, 2 + b, 0});                                  // a line
    }
  const RoomPatches cubes(floor_and_corner, 0.2);
  CHECK(cubes.size() == 1);
  REQUIRE(cubes.at({0.15f, 0.05f, 0.04f}) != nullptr);
  CHECK(std::abs(cubes.at({0.15f, 0.05f, -0.04f})->normal.z()) == doctest::Approx(1));
  CHECK(cubes.at({0.15f, 0.05f, 0.5f}) == nullptr);

  const GeneratedSweeps generated = generate_sweeps({.noise_m = 0, .headings = 240, .beams = 181}, 2);
  const RoomPatches room(in_room(generated.recording.sweeps[0], to_rigid(generated.truth[0])), 0.2);
  PoseParameters mount = generated.truth[1];
  for (const Parameter off : {kX, kY}) mount[off] += 0.01;
  for (const Parameter off : {kYaw, kPitch}) mount[off] += 0.5 * kDegree;
  PatchFit fit;
  for (int i = 0; i < 10; ++i) mount = (fit = step_onto(room, generated.recording.sweeps[1], mount, {})).mount;
  for (size_t i = 0; i < 6; ++i) CHECK(std::abs(mount[i] - generated.truth[1][i]) < 2e-3);
  CHECK(mount[kZ] == generated.truth[1][kZ]);
  CHECK(mount[kRoll] == generated.truth[1][kRoll]);
  CHECK(fit.residual_m < 1e-3);
  CHECK(fit.paired > 0.5);
  // Nothing to go by: the mount stays.
  CHECK(step_onto(RoomPatches({}, 0.2), generated.recording.sweeps[1], mount, {}).mount == mount);
}

TEST_CASE("mounts of two scanners are found in generated sweeps") {
  for (const uint64_t seed : {1u, 2u}) {
    const GeneratedSweeps generated = generate_sweeps(kFew, seed);
    const auto found = calibrate_lasers(generated.recording, {});
    REQUIRE(found.size() == 2);
    for (size_t s = 0; s < 2; ++s) {
      INFO("scanner ", found[s].name, " of seed ", seed);
      CHECK(found[s].converged);
      const PoseError before = error_of(to_rigid(generated.recording.sweeps[s].mount), to_rigid(generated.truth[s])),
                      after = error_of(to_rigid(found[s].mount), to_rigid(generated.truth[s]));
      CHECK(after.m < 0.02);
      CHECK(after.rad < 0.6 * kDegree);
      CHECK(after.m < before.m);
      CHECK(after.rad < before.rad);
    }
    CHECK(found[1].residual_m < 0.005);
    CHECK(found[1].paired > 0.5);
    const cv::Mat picture = draw_calibration(generated.recording, found);
    CHECK(picture.cols == 3 * picture.rows / 2);
    CHECK(cv::norm(picture, cv::NORM_INF) > 200);
  }
}

TEST_CASE("a recording comes back from its file") {
  const takt::test::TemporaryFolder folder;
  const auto file = folder.path / "sweeps.txt";
  const GeneratedSweeps generated = generate_sweeps(kFew, 3);
  write_laser_recording(file, generated.recording, generated.beams);
  const LaserRecording read = read_laser_recording(file);
  CHECK(read.object_height_m == generated.recording.object_height_m);
  REQUIRE(read.sweeps.size() == 2);
  for (size_t s = 0; s < 2; ++s) {
    const LaserSweep &a = read.sweeps[s], &b = generated.recording.sweeps[s];
    CHECK(a.name == b.name);
    for (size_t i = 0; i < 6; ++i) CHECK(a.mount[i] == doctest::Approx(b.mount[i]));
    REQUIRE(a.returns.size() == b.returns.size());
    size_t same = 0;
    for (size_t i = 0; i < a.returns.size(); ++i)
      same += std::abs(a.returns[i].heading_rad - b.returns[i].heading_rad) < 1e-9 &&
              std::abs(a.returns[i].angle_rad - b.returns[i].angle_rad) < 1e-9 &&
              std::abs(a.returns[i].range_m - b.returns[i].range_m) < 6e-5 &&
              a.returns[i].on_object == b.returns[i].on_object;
    CHECK(same == a.returns.size());
  }
}

TEST_CASE("what is wrong with a recording is told with its line") {
  const takt::test::TemporaryFolder folder;
  const auto file = folder.path / "sweeps.txt";
  const std::string head = "object 1.2  # high\nbeams -90 1\nscanner left 0 0 0.9 0 0 45\n";
  const auto told = [&](const std::string& text, const std::string& words) {
    const std::string problem = refusal(file, text);
    INFO(problem);
    CHECK(problem.find(file.string()) == 0);
    CHECK(problem.find(words) != std::string::npos);
  };
  told("laser 1\n", ":1: \"laser\" must be object, scanner, beams or scan");
  told("object high\n", ":1: \"high\" must be the object's height, a number");
  told("object 0\n", "above 0");
  told("object 1 2\n", "\"2\" is one word too many");
  told("object 1\nscanner left 0 0 0.9 0 0\n", ":2: \"\" must be one of x y z");
  told("scan 0 1 2\n", "before any `scanner`");
  told("scanner left 0 0 0.9 0 0 45\nscan 0 1 2\n", ":2: `scan` comes before `beams`");
  told(head + "scan 0 1.5 1.x*\n", ":4: \"1.x\" must be a range");
  told(head + "scan 0 1.5* 0 1.7\n", "left has 1 returns on the object");
  told("beams -90 1\n", "no line \"object");
  told("object 1\n", "no line \"scanner");
  std::string flat = "object 1.2\nbeams 0 1\nscanner left 0 0 0.9 0 0 0\nscan 0";
  for (int i = 0; i < 100; ++i) flat += " 1*";
  told(flat + "\n", "roll of 0");
  CHECK_THROWS_AS(read_laser_recording(folder.path / "none.txt"), std::invalid_argument);
}
