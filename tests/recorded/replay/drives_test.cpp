// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "hal/replay/carmen_log.hpp"
#include "hal/replay/replay_base.hpp"
#include "hal/replay/replay_camera.hpp"
#include "hal/replay/replay_laser.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::replay;
using namespace takt::test;

// The suites read every 20 ms. Recorded scans are seconds apart, so that the log has to run fast enough for one in each
// of the first five reads; a minute of driving passes while the base is read.
TEST_CASE("recorded drives conform") {
  struct Drive {
    const char* file;
    double laser_speed, moving_s;
  };
  for (const Drive& drive : {Drive{"sick/carmen/intel-corrected.log", 115, 400},
                             Drive{"sick/carmen/freiburg-101-corrected.log", 150, 396}}) {
    const auto path = recording(drive.file);
    const auto log = load_carmen_log("log", path);
    REQUIRE(log.has_value());
    ReplayLaser laser("laser", {path, {drive.laser_speed, log->scans.front().time_ns}, {}, 0});
    check_laser_scanner(laser);
    const auto moving = std::find_if(log->odometry.begin(), log->odometry.end(), [&](const TimedPose& line) {
      return line.time_ns >= std::llround(drive.moving_s * 1e9);
    });
    REQUIRE(moving != log->odometry.end());
    ReplayBase base("base", {path, {40, moving->time_ns}});
    check_mobile_base(base, false);
  }
}

TEST_CASE("a real KITTI sequence opens with its calibration") {
  const auto path = recording("stereo_sequence/kitti06");
  ReplayCameraSettings s;
  s.directory = path;
  s.rate = {10, 1};
  VirtualClock clock;
  ReplayCamera camera("camera", s, clock);
  REQUIRE(camera.open().has_value());
  CHECK(camera.frames() == 35);
  CHECK(camera.format().width == 1226);
  CHECK(camera.format().channels == 1);
  CHECK(camera.format().camera.baseline_m == doctest::Approx(0.53715).epsilon(1e-4));
}
