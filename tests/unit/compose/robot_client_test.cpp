// SPDX-License-Identifier: Apache-2.0
// From a task that somebody says to a full cup, in a graph on the simulated base, in virtual time. The probe is actor
// and eyes: it carries the kitchen's actions out where the robot stands, and reports the objects with their states.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

struct SeenKitchen {
  std::string actions, speech;  ///< done, joined by `; `; all that was said
  double farthest_m = 0;        ///< of an action's objects from the robot
  double touched_m_s = 0;       ///< fastest while an action was under way
  uint32_t under_way = 0;       ///< jobs with a task taken and not over
  std::string left;             ///< task in the end
  std::string plan;             ///< with what its steps took
};

struct Thing {
  const char *name, *type;
  float x_m, y_m;
  bool full, closed, can_close;
};

/// graph/networks/kitchen.yaml, as it really is.
class Kitchen final : public Node {
 public:
  SeenKitchen seen;

  void setup(Setup&) override { objects_.reserve({0, 0, 1, 8}); }
  void run(Job& job) override {
    if (const TextStatus* speech = speech_.newest(); speech != nullptr && speech_.is_new())
      seen.speech.append(speech->text.data(), speech->text.size).append("\n");
    if (const TextStatus* plan = plan_.newest()) seen.plan.assign(plan->text.data(), plan->text.size);
    if (const RobotTask* taken = taken_.newest()) {
      seen.left.assign(taken->text.data(), taken->text.size);
      seen.under_way += seen.left.empty() ? 0 : 1;
    }
    if (const ActionCommand* command = command_.newest(); command != nullptr && command->number != 0)
      go_on(*command, job.release_ns());
    ActionOutcome* outcome = outcome_.loan();
    ObjectReports* objects = objects_.loan();
    if (outcome == nullptr || objects == nullptr) return job.no_result();
    outcome->number = number_;
    outcome->state = state_;
    outcome->duration_s = static_cast<double>(job.release_ns() - began_ns_) * 1e-9;
    outcome_.send(job.release_ns());
    objects->in_map = 1;
    for (const Thing& thing : things_) report(thing, *objects);
    objects_.send(job.release_ns());
  }

 private:
  void go_on(const ActionCommand& command, int64_t now_ns) {
    const Odometry* robot = odometry_.newest();
    if (robot == nullptr) return;
    if (command.number != number_) {
      number_ = command.number;
      state_ = action_state::under_way;
      began_ns_ = now_ns;
      for (const auto& name : command.objects)
        if (const Thing* thing = find(name))
          seen.farthest_m = std::max(seen.farthest_m, std::hypot(thing->x_m - robot->x_m, thing->y_m - robot->y_m));
    }
    if (state_ != action_state::under_way) return;
    seen.touched_m_s = std::max(seen.touched_m_s, std::abs(robot->speed_m_s));
    const bool opens = std::strcmp(command.action, "open") == 0;
    if (now_ns - began_ns_ < (opens ? 4'000'000'000 : 6'000'000'000)) return;
    state_ = action_state::done;
    seen.actions += std::string(seen.actions.empty() ? "" : "; ") + command.action + " " + command.objects[0];
    if (opens) {
      find(command.objects[0])->closed = false;
    } else {
      find(command.objects[0])->full = true;
      find(command.objects[1])->full = false;
    }
  }
  Thing* find(const char* name) {
    for (Thing& thing : things_)
      if (std::strcmp(thing.name, name) == 0) return &thing;
    return nullptr;
  }
  static void report(const Thing& thing, ObjectReports& objects) {
    ObjectName name;
    std::strcpy(name.name, thing.name);
    std::strcpy(name.type, thing.type);
    objects.names.push_back(name);
    objects.places.push_back({thing.x_m, thing.y_m, 0, 0, 1, thing.can_close ? 2.0f : 1.0f});
    objects.attributes.push_back(attribute("level", thing.full ? "full" : "empty"));
    if (thing.can_close) objects.attributes.push_back(attribute("closed", thing.closed ? "true" : "false"));
  }
  static ObjectAttribute attribute(const char* name, const char* value) {
    ObjectAttribute a;
    std::strcpy(a.name, name);
    std::strcpy(a.value, value);
    return a;
  }

  Thing things_[3] = {{"cup_1", "cup", 2, 0, false, false, false},
                      {"bottle_1", "bottle", 3, 1, true, true, true},
                      {"bottle_2", "bottle", 8, 1, true, false, true}};
  uint32_t number_ = 0;
  uint8_t state_ = action_state::none;
  int64_t began_ns_ = 0;
  Input<ActionCommand> command_{this, "command", ""};
  Input<Odometry> odometry_{this, "odometry", ""};
  Input<TextStatus> speech_{this, "speech", ""};
  Input<RobotTask> taken_{this, "taken", ""};
  Input<TextStatus> plan_{this, "plan", ""};
  Output<ActionOutcome> outcome_{this, "outcome", ""};
  Output<ObjectReports> objects_{this, "objects", ""};
};

constexpr test::DriveGraph kKitchenGraph{
    .devices = R"(
  base: {kind: mobile_base, rate: 15, drive: command, in: {velocity: {from: client.velocity, max_age: 300ms}}}
  person: {kind: interaction, rate: 5, script: "1s goal cup_1.level=full", in: {speech: {from: client.speech, depth: 4}}}
)",
    .nodes = R"(
    exports: [client.velocity, client.speech]
    probe:
      type: probe
      in: {command: client.action, odometry: base.odometry, speech: client.speech, taken: client.taken, plan: client.plan}
    client:
      type: robot_client
      in:
        odometry: {from: base.odometry, max_age: 300ms}
        objects: {from: probe.objects, depth: 4}
        outcome: probe.outcome
        task: person.task
      params: {network: @/networks/kitchen.yaml}
)",
    .schedule = R"(
  base: {rate: 15, budget: 1ms}
  person: {rate: 5, budget: 1ms}
  client: {rate: 15, offset: 5ms, budget: 20ms, criticality: high}
  probe: {rate: 15, offset: 40ms, budget: 2ms}
)",
};

}  // namespace

TEST_CASE("a goal that somebody says is planned, driven, acted and reported, within reach and standing") {
  const test::Drive<Kitchen> drive(kKitchenGraph, 60'000'000'000);
  const SeenKitchen& seen = drive.probe().seen;
  MESSAGE("said:\n"
          << seen.speech << seen.plan << "farthest object " << seen.farthest_m << " m, " << seen.under_way << " jobs");
  CHECK(seen.actions == "open bottle_1; fill cup_1");
  CHECK(seen.speech.find("goal cup_1.level=full: done") != std::string::npos);
  CHECK(seen.speech.find("plan again") == std::string::npos);
  CHECK(seen.farthest_m <= 0.8);
  CHECK(seen.touched_m_s < 0.02);
  CHECK(seen.under_way > 100);
  CHECK(seen.left.empty());
  std::istringstream plan(seen.plan);
  size_t steps = 0, learned = 0;
  for (std::string line; std::getline(plan, line);) {
    if (const size_t said = line.find(" is taken to last "); said != std::string::npos) {
      double mean_s = 0, declared_s = 0;
      REQUIRE(std::sscanf(line.c_str() + said, " is taken to last %lf s, declared %lf s", &mean_s, &declared_s) == 2);
      CHECK(mean_s == doctest::Approx(declared_s).epsilon(0.2));
      ++learned;
      continue;
    }
    ++steps;
    double drive_s = 0, drove_s = 0, act_s = 0, acted_s = 0;
    const std::string times = line.substr(line.find(": drive "));
    REQUIRE(std::sscanf(times.c_str(), ": drive %lf s (took %lf), act %lf s (took %lf)", &drive_s, &drove_s, &act_s,
                        &acted_s) == 4);
    CHECK(drove_s == doctest::Approx(drive_s).epsilon(0.2));
    CHECK(acted_s == doctest::Approx(act_s).epsilon(0.2));
  }
  CHECK(steps == 2);
  CHECK(learned == 2);
}
