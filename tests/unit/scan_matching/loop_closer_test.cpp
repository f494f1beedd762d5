// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/loop_closer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "nodes/scan_matching/drive.hpp"
#include "nodes/scan_matching/evaluate.hpp"
#include "rt/memory/memory_use.hpp"
#include "tests/going_on.hpp"

using namespace takt;
using namespace takt::scan_matching;

namespace {

/// How far a pose is off, in the frame of the drive's first scan.
double off_m(const Drive& drive, size_t scan, const PlanarPose& pose) {
  return error_between(pose, between(drive.scans[0].truth, drive.scans[scan].truth)).error_m;
}

struct Looped {
  size_t closures = 0;
  double first_off_m = 0, first_left_m = 0;  ///< at the first closure: before and after it
  double track_off_m = 0, map_off_m = 0;     ///< at the end
};

/// The closer behind a matcher whose every step is off by `wrong`. Scans from `seen_from` on are those of `other`.
Looped follow(const Drive& drive, const PlanarPose& wrong, const Drive* other = nullptr, size_t seen_from = 0,
              size_t goes_on_after = SIZE_MAX) {
  auto going = std::make_unique<LoopCloser>(drive.beams, MapParameters{}, ClosureParameters{});
  std::vector<SurfacePoint> points;
  points.reserve(drive.beams);
  PlanarPose track;
  Looped out;
  for (size_t i = 0; i < drive.scans.size(); ++i) {
    if (i > 0) track = compose(track, compose(drive.moved_truly(i), wrong));
    points_of((other && i >= seen_from ? *other : drive).sweep(i), 15, points);
    if (i > 0 && i % goes_on_after == 0)
      going = test::going_on(*going, std::make_unique<LoopCloser>(drive.beams, MapParameters{}, ClosureParameters{}));
    LoopCloser& closer = *going;
    const auto allocations = thread_memory_use().allocations;
    const auto closure = closer.step(track, points);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == allocations);
    if (!closure) continue;
    CHECK(error_between(closure->actual, closer.robot_in_map(track)).error_m < 1e-9);
    if (out.closures++ > 0) continue;
    out.first_off_m = off_m(drive, i, closure->believed);
    out.first_left_m = off_m(drive, i, closure->actual);
  }
  out.track_off_m = off_m(drive, drive.scans.size() - 1, track);
  out.map_off_m = off_m(drive, drive.scans.size() - 1, going->robot_in_map(track));
  return out;
}

constexpr PlanarPose kDrifting{0, 0.001, 0.0015};  // a hundredth of the way, 0.86 degrees a metre

}  // namespace

TEST_CASE("a robot that comes back where it was is told where it is, and goes on from there") {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const Drive drive = make_drive(furnished_room(seed), rounds(400), {}, seed);
    const Looped looped = follow(drive, kDrifting);
    MESSAGE(looped.closures << " closures; the first from " << looped.first_off_m << " to " << looped.first_left_m
                            << " m; at the end " << looped.map_off_m << " m instead of " << looped.track_off_m);
    REQUIRE(looped.closures > 0);
    CHECK(looped.first_left_m < 0.5 * looped.first_off_m);
    CHECK(looped.track_off_m > 0.3);
    CHECK(looped.map_off_m < 0.3 * looped.track_off_m);
  }
}

TEST_CASE("a robot that goes on from what was remembered is told the same, bit for bit") {
  const Drive drive = make_drive(furnished_room(1), rounds(400), {}, 1);
  const Looped straight = follow(drive, kDrifting), interrupted = follow(drive, kDrifting, nullptr, 0, 7);
  CHECK(straight.closures > 0);
  CHECK(interrupted.closures == straight.closures);
  CHECK(interrupted.first_left_m == straight.first_left_m);
  CHECK(interrupted.map_off_m == straight.map_off_m);
}

TEST_CASE("without an error nothing is corrected") {
  const Drive drive = make_drive(furnished_room(1), rounds(300), {}, 1);
  CHECK(follow(drive, {}).closures == 0);
}

TEST_CASE("a place that looks otherwise is no known one") {
  std::vector<Wall> smaller = furnished_room(2);
  for (Wall& w : smaller) w = {0.6 * w.x0_m, 0.6 * w.y0_m, 0.6 * w.x1_m, 0.6 * w.y1_m};
  const Drive drive = make_drive(furnished_room(1), rounds(190), {}, 1),
              other = make_drive(smaller, rounds(190), {}, 1);
  CHECK(follow(drive, kDrifting, &other, 95).closures == 0);  // less than 10 m in either
  CHECK(follow(drive, kDrifting).closures > 0);
}

TEST_CASE("along a corridor no loop is closed: nothing says where along it the robot is") {
  std::vector<PlanarPose> to_and_fro;
  for (int i = 0; i < 160; ++i) to_and_fro.push_back({0, 0.1 * i, 0});
  for (int i = 160; i > 0; --i) to_and_fro.push_back({0, 0.1 * i, 0});
  const Drive drive = make_drive(corridor(), to_and_fro, {}, 1);
  const Looped looped = follow(drive, {0, 0.002, 0});
  CHECK(looped.track_off_m > 0.5);
  CHECK(looped.closures == 0);
}
