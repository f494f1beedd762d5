// SPDX-License-Identifier: Apache-2.0
#include "hal/actor/actor_node.hpp"

#include <doctest/doctest.h>

#include "rt/msg/ace/action.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

using namespace takt;

namespace {

/// Notes the last command.
class NotingActor final : public Actor {
 public:
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
  bool command(const ActionCommand& command, int64_t) override {
    number = command.number;
    return true;
  }
  ActorReading read(int64_t wanted_ns, int64_t) override {
    ActorReading reading{ReadStatus::ok, wanted_ns, {}};
    reading.outcome.number = number;
    reading.outcome.state = action_state::under_way;
    return reading;
  }
  uint32_t number = 0;
};

}  // namespace

TEST_CASE("the actor node passes commands on, but not in safe_stop and no stale ones, and always tells the outcome") {
  auto* actor = new NotingActor;  // owned by the node
  ActorNode node{std::unique_ptr<Actor>(actor)};
  const VirtualClock clock;
  Setup setup{clock, ".", {}, 1, Rate{15, 1}};
  node.setup(setup);
  node.start(0);
  test::BoxWriter<ActionOutcome> writer(*node.outputs().at(0));
  InputPort& command = test::input(node, "command");
  test::Box<ActionCommand> wanted;
  const auto job = [&](std::string_view mode) {
    actor->number = 0;
    writer.clear();
    Job one(clock, 0, 1000, 66'000'000, 0, mode);
    node.run(one);
    CHECK(writer.sent());
    CHECK(writer.stamp_ns() == 1000);
    CHECK(writer.message().number == actor->number);
    return actor->number;
  };
  CHECK(job("full") == 0);
  wanted->number = 7;
  PortAccess::connect(command, {});
  test::latch(command, wanted, 0, 1);
  CHECK(job("full") == 7);
  CHECK(job("safe_stop") == 0);
  CHECK(job("") == 0);
  PortAccess::set_held(command, 1, true, 0);
  CHECK(job("full") == 0);
}
