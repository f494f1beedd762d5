// SPDX-License-Identifier: Apache-2.0
// From `lost` in a graph to a robot that stands: the plan's rules, and a drive in virtual time whose scanner fails.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "graph/ace/ace_registry.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

constexpr double kSpeed = 0.4;

struct SeenModes {
  std::map<double, std::string> mode;  ///< by seconds since the epoch
  std::map<double, double> speed_m_s;  ///< likewise, of the odometry's stamp
  double speed_at(double from_s, double to_s, bool fastest) const {
    double extreme = fastest ? -1 : 1e9;
    for (auto it = speed_m_s.lower_bound(from_s); it != speed_m_s.end() && it->first < to_s; ++it)
      extreme = fastest ? std::max(extreme, std::abs(it->second)) : std::min(extreme, std::abs(it->second));
    return extreme;
  }
};

/// Wants to drive, whatever happens.
class Driver final : public Node {
 public:
  SeenModes seen;

  void setup(Setup&) override {}
  void start(int64_t epoch_ns) override { epoch_ns_ = epoch_ns; }
  void run(Job& job) override {
    seen.mode[seconds(job.release_ns())] = job.mode();
    if (const Odometry* odometry = odometry_.newest(); odometry != nullptr && odometry_.is_new())
      seen.speed_m_s[seconds(odometry_.stamp_ns())] = odometry->speed_m_s;
    VelocityCommand* wanted = velocity_.loan();
    if (wanted == nullptr) return;
    wanted->speed_m_s = kSpeed;
    wanted->turn_rad_s = 0;
    velocity_.send(job.release_ns());
  }

 private:
  double seconds(int64_t ns) const { return static_cast<double>(ns - epoch_ns_) * 1e-9; }
  int64_t epoch_ns_ = 0;
  Input<Odometry> odometry_{this, "odometry", ""};
  Input<LaserScan> scan_{this, "scan", ""};
  Output<VelocityCommand> velocity_{this, "velocity", ""};
};

constexpr test::DriveGraph kLostLaserGraph{
    .devices = R"(
  front_laser: {kind: laser_scanner, rate: 15, failures: "silent 2s..3s"}
  base: {kind: mobile_base, rate: 15, drive: command, in: {velocity: driver.velocity}}
)",
    .nodes = R"(
    exports: [driver.velocity]
    driver: {type: probe, in: {odometry: base.odometry, scan: front_laser.scan}}
modes:
  safe_stop: {lost: [front_laser]}
)",
    .schedule = R"(
  front_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  driver: {rate: 15, offset: 20ms, budget: 1ms, criticality: high}
)",
};

std::vector<std::string> names(const Plan& plan, SourceSet set) {
  std::vector<std::string> all;
  for (size_t i = 0; i < plan.mode_rules.sources.size(); ++i)
    if (((set >> i) & 1) != 0) all.push_back(plan.tasks[plan.mode_rules.sources[i]].name);
  return all;
}

Plan plan_of_ace(const std::string& mode) {
  graph::LoadOptions options;
  options.mode = mode;
  const graph::Loaded loaded = graph::load(test::graph_folder() / "ace.yaml", options, ace_registry());
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  static VirtualClock clock;
  Plan plan = graph::outline(*loaded.graph, ace_registry(), clock).plan;
  for (TaskPlan& task : plan.tasks) task.node = nullptr;  // the composition is gone
  return plan;
}

bool runs(const Plan& plan, const std::string& mode, const std::string& task) {
  for (const ModePlan& m : plan.modes)
    for (size_t t = 0; t < plan.tasks.size(); ++t)
      if (m.name == mode && plan.tasks[t].name == task) return m.runs[t] != 0;
  FAIL("no such mode or task");
  return false;
}

}  // namespace

TEST_CASE("a robot whose scanner falls silent stands until it is back, whatever it is told to do") {
  const test::Drive<Driver> drive(kLostLaserGraph, 6'000'000'000);
  const SeenModes& seen = drive.probe().seen;
  std::vector<std::string> modes;
  double stopped_s = 0, back_s = 0;
  for (const auto& [at_s, mode] : seen.mode) {
    if (modes.empty() || modes.back() != mode) modes.push_back(mode);
    if (mode == "safe_stop" && stopped_s == 0) stopped_s = at_s;
    if (mode == "full" && stopped_s != 0 && back_s == 0) back_s = at_s;
  }
  CHECK(modes == std::vector<std::string>{"full", "safe_stop", "full"});
  CHECK(stopped_s > 2.2);  // 300 ms after the last scan
  CHECK(stopped_s < 2.5);
  CHECK(back_s > 3.5);  // 500 ms of scans
  CHECK(back_s < 3.7);
  CHECK(seen.speed_at(1, 2.2, false) > 0.9 * kSpeed);
  CHECK(seen.speed_at(stopped_s + 0.5, back_s, true) < 1e-9);  // braking is limited by the base
  CHECK(seen.speed_at(4.5, 6, false) > 0.9 * kSpeed);
}

TEST_CASE("ace: the rules in the order of the file, by task and mode; a lost device's jobs go on") {
  const Plan plan = plan_of_ace("full");
  using Names = std::vector<std::string>;
  const auto& rules = plan.mode_rules.rules;
  REQUIRE(rules.size() == 3);
  CHECK(plan.modes[rules[0].mode].name == "no_stereo");
  CHECK(names(plan, rules[0].covers) == Names{"head_camera"});
  CHECK(plan.modes[rules[1].mode].name == "laser_only");
  CHECK(names(plan, rules[1].covers) == Names{"head_camera", "ground_camera"});
  CHECK(rules[2].mode == plan.safe_stop);
  CHECK(names(plan, rules[2].covers) == Names{"front_laser", "lines", "base"});
  CHECK(runs(plan, "laser_only", "head_camera"));
  CHECK(runs(plan, "laser_only", "ground_camera"));
  CHECK_FALSE(runs(plan, "laser_only", "ground_map"));
  for (const char* blind : {"scan_matching", "robot_pose", "traversability"}) CHECK(runs(plan, "laser_only", blind));
  for (const char* seeing : {"semantic_map", "person_tracking", "laser_fusion"})
    CHECK_FALSE(runs(plan, "no_stereo", seeing));
  for (const char* needed : {"base", "front_laser", "lines", "obstacle_stop", "robot_pose"})
    CHECK(runs(plan, "safe_stop", needed));
  CHECK_FALSE(runs(plan, "safe_stop", "mapping_3d"));
}

TEST_CASE("ace started in a smaller mode: what it leaves out cannot be lost, what needs more is out of reach") {
  const Plan plan = plan_of_ace("laser_only");
  const auto& rules = plan.mode_rules.rules;
  REQUIRE(rules.size() == 3);
  CHECK(rules[0].mode == ModeRule::kUnreachable);
  CHECK(rules[0].covers == 0);
  CHECK(rules[1].mode == 0);
  CHECK(rules[1].covers == 0);
  CHECK(names(plan, rules[2].covers) == std::vector<std::string>{"front_laser", "lines", "base"});
  CHECK(plan_of_ace("no_stereo").mode_rules.rules[0].mode == 0);
}
