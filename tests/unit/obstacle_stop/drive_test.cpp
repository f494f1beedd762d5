// SPDX-License-Identifier: Apache-2.0
// The whole loop without vision: simulated scanner and base, obstacle_stop between them, job by job on virtual time.
#include <doctest/doctest.h>

#include <cmath>

#include "hal/base/base_node.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/sim/sim_devices.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/unit/sim/small_world.hpp"

namespace takt {
void register_obstacle_stop(NodeTypes& types);
}

using namespace takt;

namespace {

/// An empty hall with a wall across at x = 9 m; the robot starts at 1.5 m and looks along x.
std::unique_ptr<sim::Simulation> hall() {
  sim::World world = test::small_world();
  world.objects.clear();
  world.map.width = 100;
  world.map.occupied.assign(5000, 0);
  for (size_t y = 0; y < 50; ++y)
    for (size_t x = 90; x < 100; ++x) world.map.occupied[y * 100 + x] = 1;
  auto simulation = std::make_unique<sim::Simulation>(std::move(world), 0, 3);
  simulation->set_drive(sim::Drive::command);
  return simulation;
}

template <class T>
void hand_over(test::BoxWriter<T>& from, InputPort& to, uint64_t sequence) {
  REQUIRE(from.sent());
  PortAccess::held(to)[0] = {from.loaned(), sequence, from.stamp_ns(), 0, 0};
  PortAccess::set_held(to, 1, false, sequence - 1);
}

}  // namespace

TEST_CASE("a robot that is told to drive at a wall stands before it, at any speed; without the node it runs into it") {
  for (const double speed : {0.3, 0.8, 1.4}) {
    for (const bool guarded : {true, false}) {
      CAPTURE(speed);
      CAPTURE(guarded);
      const auto world = hall();
      VirtualClock clock(1'000'000'000);
      sim::LaserModel model;
      model.sensor_in_robot.y = 0.3;
      model.sensor_in_robot.z = 0.25;
      LaserNode laser(std::make_unique<sim::SimLaser>("laser", model, *world));
      BaseNode base(std::make_unique<sim::SimBase>("base", sim::OdometryModel{}, *world));
      NodeTypes types;
      register_obstacle_stop(types);
      const auto guard = types.find("obstacle_stop")->make();
      Setup setup{clock, ".", ".", 0, Rate{15, 1}, 0};
      laser.setup(setup);
      base.setup(setup);
      PortAccess::connect(test::input(*guard, "scan"), laser.outputs()[0]->capacity());
      PortAccess::connect(test::input(*guard, "odometry"), {});
      PortAccess::connect(test::input(base, "velocity"), {});
      if (guarded) PortAccess::connect(test::input(base, "stop"), {});
      guard->setup(setup);
      test::BoxWriter<LaserScan> scan(*laser.outputs()[0]);
      test::BoxWriter<Odometry> odometry(*base.outputs()[0]);
      test::BoxWriter<StopCommand> stop(*guard->outputs()[0]);
      test::Box<VelocityCommand> velocity;
      velocity->speed_m_s = speed;
      laser.start(1'000'000'000);
      base.start(1'000'000'000);
      double fastest = 0;
      for (uint64_t k = 0; k < 450; ++k) {
        const int64_t release = Rate{15, 1}.release_ns(1'000'000'000, static_cast<int64_t>(k));
        clock.advance_to(release);
        Job job(clock, k, release, release + 66'000'000, 0, "full");
        // As the latch gives it: everybody works on what the jobs before published.
        if (k > 0) {
          hand_over(odometry, test::input(*guard, "odometry"), k);
          hand_over(scan, test::input(*guard, "scan"), k);
          if (guarded) hand_over(stop, test::input(base, "stop"), k);
        }
        test::latch(test::input(base, "velocity"), velocity, release, k + 1);
        stop.clear();
        guard->run(job);
        odometry.clear();
        base.run(job);
        scan.clear();
        laser.run(job);
        fastest = std::max(fastest, world->robot(release).speed_m_s);
      }
      const auto robot = world->robot(clock.now_ns());
      CHECK(fastest > 0.9 * speed);
      const double gap = 9.0 - robot.x_m - 0.39;  // from the robot's front to the wall
      if (guarded) {
        CHECK(std::abs(robot.speed_m_s) < 0.01);
        CHECK(gap > 0.0);
        CHECK(gap < 1.0);
        CHECK_FALSE(world->blocked());
      } else {
        CHECK(world->blocked());
      }
      laser.finish();
      base.finish();
    }
  }
}
