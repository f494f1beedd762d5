// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/sim/failing_devices.hpp"
#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "hal/sim/sim_objects.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/unit/sim/acting_world.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;

TEST_CASE("sim camera conforms") {
  // One world for each camera, as the world keeps the epoch of its first user.
  std::vector<std::unique_ptr<Simulation>> worlds;
  const auto make = [&](const Clock& clock) -> std::unique_ptr<StereoCamera> {
    worlds.push_back(std::make_unique<Simulation>(test::path_world(), 0, 3));
    return std::make_unique<SimCamera>("camera", SimCameraSettings{test::small_rig(), {}, {15, 1}, true},
                                       *worlds.back(), clock);
  };
  test::check_stereo_camera(make);
  test::check_free_running_camera(make);
}

TEST_CASE("sim laser, head, base and lines conform") {
  {
    const auto s = test::small_simulation();
    SimLaser laser("laser", {}, *s);
    test::check_laser_scanner(laser);
  }
  {
    const auto s = test::small_simulation();
    SimHead head("head", *s);
    test::check_camera_head(head);
  }
  {
    const auto s = test::small_simulation();
    SimBase base("base", {}, *s);
    test::check_mobile_base(base, true);
  }
  {
    Simulation s(test::path_world(), 0, 3);
    SimBase base("base", {}, s);
    test::check_mobile_base(base, false);
  }
  {
    const auto s = test::small_simulation();
    SimLines lines("lines", *s);
    test::check_digital_lines(
        lines, 0, [&](uint32_t line, bool level) { s->force_line(line, level ? 1 : 0); }, test::no_pace);
  }
}

TEST_CASE("object sensor and actor conform, also behind what would make them fail") {
  const char* eye = R"(<client name="eye" x="3.5m" y="3.25m" theta="180deg"/>)";
  const auto failures = [] { return FailureSchedule(*parse_failures("silent 900s..901s")); };
  const ActionCommand good = test::action_command(1, "open", "bottle"), bad = test::action_command(2, "open", "crate");
  {
    Simulation s(test::acting_stage(eye), 2);
    SimObjectSensor sensor("sensor", {}, s);
    test::check_object_sensor(sensor);
  }
  {
    Simulation s(test::acting_stage(eye), 2);
    FailingObjectSensor sensor(std::make_unique<SimObjectSensor>("sensor", PerceptionModel{}, s), failures());
    test::check_object_sensor(sensor);
  }
  {
    Simulation s(test::acting_stage(), 0);
    SimActor actor("actor", s);
    test::check_actor(actor, good, bad);
  }
  {
    Simulation s(test::acting_stage(), 0);
    FailingActor actor(std::make_unique<SimActor>("actor", s), failures());
    test::check_actor(actor, good, bad);
  }
}
