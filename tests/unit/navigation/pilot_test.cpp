// SPDX-License-Identifier: Apache-2.0
// The behaviours in the simulated world, job by job on virtual time at 15 Hz: what the pilot says acts a job and the
// base's latency later.
#include "nodes/navigation/pilot.hpp"

#include <doctest/doctest.h>

#include "hal/base/base_node.hpp"
#include "hal/sim/sim_devices.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::navigation;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A room of 6 m x 5 m with a pillar; wheels that count truly, since their errors are not the behaviours'.
class Robot {
 public:
  explicit Robot(const PilotParameters& parameters = {}) : pilot(parameters) {
    sim::World world = test::small_world();
    world.objects.clear();
    world_ = std::make_unique<sim::Simulation>(std::move(world), 0, 3);
    world_->set_drive(sim::Drive::command);
    base_ = std::make_unique<BaseNode>(std::make_unique<sim::SimBase>("base", sim::OdometryModel{0, 0, 0, 0}, *world_));
    Setup setup{clock_, ".", ".", 0, Rate{15, 1}, 0};
    base_->setup(setup);
    PortAccess::connect(test::input(*base_, "velocity"), {});
    odometry_ = std::make_unique<test::BoxWriter<Odometry>>(*base_->outputs()[0]);
    base_->start(kEpoch_ns);
    step();
    step();
  }

  /// Until the pilot stands, at most 60 s; the largest speeds and accelerations that it asked for are kept.
  void finish() {
    for (int i = 0; i < 900 && !pilot.standing(); ++i) step();
    REQUIRE(pilot.standing());
    for (int i = 0; i < 15; ++i) step();
  }
  void step() {
    const int64_t release = Rate{15, 1}.release_ns(kEpoch_ns, static_cast<int64_t>(++jobs_));
    clock_.advance_to(release);
    const Velocity before = now_;
    if (jobs_ > 1) {
      const uint64_t allocations = thread_memory_use().allocations;
      now_ = pilot.step(pose(), 1 / 15.0);
      if (counting_allocations()) CHECK(thread_memory_use().allocations == allocations);
    }
    fastest = std::max(fastest, std::abs(now_.speed_m_s));
    fastest_turn = std::max(fastest_turn, std::abs(now_.turn_rad_s));
    acceleration = std::max(acceleration, 15 * std::abs(now_.speed_m_s - before.speed_m_s));
    turn_acceleration = std::max(turn_acceleration, 15 * std::abs(now_.turn_rad_s - before.turn_rad_s));
    // The base reads what the pilot said in the job before.
    velocity_->speed_m_s = before.speed_m_s;
    velocity_->turn_rad_s = before.turn_rad_s;
    test::latch(test::input(*base_, "velocity"), velocity_, release, jobs_);
    odometry_->clear();
    Job job(clock_, jobs_, release, release + 66'000'000, 0, "full");
    base_->run(job);
  }
  /// As the job before measured it, in the map.
  PlanarPose pose() const {
    const Odometry& o = odometry_->message();
    return compose(kStart, {o.x_m, o.y_m, o.theta_rad});
  }
  PlanarPose truth() const {
    const auto robot = world_->robot(clock_.now_ns());
    return {robot.x_m, robot.y_m, robot.theta_rad};
  }
  bool touched() const { return world_->blocked(); }
  OccupancyView grid() {
    const auto& map = world_->world().map;
    cells_.clear();
    for (const auto occupied : map.occupied) cells_.push_back(occupied != 0 ? 1000 : 0);
    return {{cells_.data(), map.width, map.height}, map.cell_m, 0, 0};
  }

  static constexpr PlanarPose kStart{1.5, 2.5, 0};
  Pilot pilot;
  double fastest = 0, fastest_turn = 0, acceleration = 0, turn_acceleration = 0;

 private:
  static constexpr int64_t kEpoch_ns = 1'000'000'000;
  VirtualClock clock_{kEpoch_ns};
  std::unique_ptr<sim::Simulation> world_;
  std::unique_ptr<BaseNode> base_;
  std::unique_ptr<test::BoxWriter<Odometry>> odometry_;
  test::Box<VelocityCommand> velocity_;
  std::vector<int16_t> cells_;
  Velocity now_;
  uint64_t jobs_ = 0;
};

double error_m(const PlanarPose& a, double x_m, double y_m) { return std::hypot(a.x_m - x_m, a.y_m - y_m); }
double error_deg(const PlanarPose& a, double theta_rad) { return std::abs(wrapped(a.theta_rad - theta_rad)) / kDegree; }

/// Where a behaviour ended against where it should have; the largest errors of a test are printed.
struct Errors {
  double m = 0, deg = 0;
  ~Errors() { MESSAGE("largest errors " << m << " m, " << deg << " deg"); }
  void check(const PlanarPose& ended, double x_m, double y_m, double theta_rad) {
    CHECK(error_m(ended, x_m, y_m) < 0.05);
    CHECK(error_deg(ended, theta_rad) < 2);
    m = std::max(m, error_m(ended, x_m, y_m));
    deg = std::max(deg, error_deg(ended, theta_rad));
  }
};

}  // namespace

TEST_CASE("rotate: within 2 degrees, on the spot, by any number of turns") {
  Errors errors;
  for (const double degrees : {5.0, 90.0, -135.0, 179.0, -360.0, 500.0}) {
    CAPTURE(degrees);
    Robot robot;
    robot.pilot.rotate(robot.pose(), degrees * kDegree);
    robot.finish();
    errors.check(robot.truth(), 1.5, 2.5, degrees * kDegree);
    CHECK(robot.fastest_turn > 0.1);
    CHECK(robot.fastest_turn <= 0.8);
    CHECK(robot.turn_acceleration <= doctest::Approx(1.2));
  }
}

TEST_CASE("straight ahead and back: within 5 cm and 2 degrees, within the limits") {
  Errors errors;
  for (const double speed : {0.3, 0.8, 1.4})
    for (const double metres : {0.1, 1.0, 2.0, -0.6}) {
      CAPTURE(speed);
      CAPTURE(metres);
      PilotParameters p;
      p.limits.speed_m_s = speed;
      Robot robot(p);
      robot.pilot.straight_ahead(robot.pose(), metres);
      robot.finish();
      errors.check(robot.truth(), 1.5 + metres, 2.5, 0);
      CHECK(robot.fastest <= speed);
      CHECK(robot.acceleration <= doctest::Approx(0.6));
      CHECK_FALSE(robot.touched());
    }
}

TEST_CASE("drive to: round the pillar, within 5 cm and 2 degrees of the place that is wanted, touching nothing") {
  struct Wanted {
    double x_m, y_m, degrees;
  };
  Errors errors;
  for (const Wanted& w : {Wanted{5.2, 1.0, 90}, Wanted{5.0, 4.0, -90}, Wanted{0.8, 0.8, 180}, Wanted{1.6, 2.5, 0},
                          Wanted{1.0, 2.5, 0}, Wanted{3.1, 0.8, 45}}) {
    CAPTURE(w.x_m);
    CAPTURE(w.y_m);
    Robot robot;
    PathPlanner planner(3000, {0.55, 3});
    REQUIRE(planner.look(robot.grid()));
    std::vector<Place> way;
    REQUIRE(planner.plan({robot.pose().x_m, robot.pose().y_m}, {w.x_m, w.y_m}, 0, way) == PathOutcome::found);
    REQUIRE(robot.pilot.drive_to(way, w.degrees * kDegree));
    robot.finish();
    errors.check(robot.truth(), w.x_m, w.y_m, w.degrees * kDegree);
    CHECK(robot.fastest <= 0.8);
    CHECK(robot.acceleration <= doctest::Approx(0.6));
    CHECK(robot.turn_acceleration <= doctest::Approx(1.2));
    CHECK_FALSE(robot.touched());
  }
}

TEST_CASE("standing ends a drive within its limits, and another may follow") {
  Robot robot;
  robot.pilot.straight_ahead(robot.pose(), 3);
  for (int i = 0; i < 20; ++i) robot.step();
  CHECK(robot.fastest > 0.7);
  robot.pilot.stand();
  CHECK_FALSE(robot.pilot.standing());
  robot.finish();
  CHECK(robot.acceleration <= doctest::Approx(0.6));
  const PlanarPose here = robot.truth();
  robot.pilot.straight_ahead(robot.pose(), -0.5);
  robot.finish();
  CHECK(error_m(robot.truth(), here.x_m - 0.5, here.y_m) < 0.05);
  CHECK_FALSE(robot.pilot.drive_to({}));
}
