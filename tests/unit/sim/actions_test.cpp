// SPDX-License-Identifier: Apache-2.0
// What robots do with objects: begin, end, refusal, failure, and two of them at the same thing.
#include <doctest/doctest.h>

#include "hal/sim/sim_devices.hpp"
#include "rt/msg/ace/action.hpp"
#include "tests/has.hpp"
#include "tests/unit/sim/acting_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::action_command;
using test::has;
using test::kEpoch;
using test::kMs;

namespace {

/// Both robots of the acting world, their jobs every 50 ms.
struct Two {
  explicit Two(const std::string& more = "") : stage(test::acting_stage(more)), ace(stage, 0), bea(stage, 1) {
    stage->begin(kEpoch);
    ace.actions().start(kEpoch);
    bea.actions().start(kEpoch);
  }
  /// Jobs until that many ms after the epoch.
  void run_to(int64_t ms, bool ace_first = true) {
    for (; now_ms <= ms; now_ms += 50) {
      (ace_first ? ace : bea).actions().advance(kEpoch + now_ms * kMs);
      (ace_first ? bea : ace).actions().advance(kEpoch + now_ms * kMs);
    }
  }
  ActionOutcome outcome(Simulation& s) const { return s.actions().outcome(kEpoch + (now_ms - 50) * kMs); }
  std::string at(const char* object, const char* attribute, int64_t ms) const {
    return ace.attribute(object, attribute, kEpoch + ms * kMs).value_or("unknown");
  }
  std::shared_ptr<Stage> stage;
  Simulation ace, bea;
  int64_t now_ms = 0;
};

std::string refusal(const ActionCommand& command, const std::string& more = "") {
  Two two(more);
  two.ace.actions().command(command, kEpoch);
  two.run_to(200);
  const ActionOutcome outcome = two.outcome(two.ace);
  CHECK(outcome.number == command.number);
  CHECK(outcome.state == action_state::refused);
  CHECK(outcome.duration_s == 0);
  return outcome.reason;
}

}  // namespace

TEST_CASE("with a spread an action takes what seed, robot and action decide, each time the same, within it") {
  const auto took_s = [](bool bea, const char* action, double spread) {
    Two two;
    Simulation& robot = bea ? two.bea : two.ace;
    robot.actions().start(kEpoch, spread);
    robot.actions().command(action_command(1, action, "bottle"), kEpoch);
    two.run_to(3000);
    CHECK(two.outcome(robot).state == action_state::done);
    return two.outcome(robot).duration_s;
  };
  CHECK(took_s(false, "open", 0) == doctest::Approx(1));
  const double first = took_s(false, "open", 0.3);
  CHECK(first == took_s(false, "open", 0.3));
  CHECK(first != took_s(true, "open", 0.3));
  CHECK(std::abs(first - 1) <= 0.3);
  CHECK(std::abs(first - 1) > 0.001);
  CHECK(took_s(false, "open", 0.6) - 1 == doctest::Approx(2 * (first - 1)));
}

TEST_CASE("an action begins 100 ms after its command, takes its cost, and then its results are true") {
  Two two;
  CHECK(two.outcome(two.ace).state == action_state::none);
  REQUIRE(two.ace.actions().command(action_command(7, "open", "bottle"), kEpoch));
  two.run_to(50);
  CHECK(two.outcome(two.ace).state == action_state::under_way);
  CHECK(two.outcome(two.ace).duration_s == 0);
  two.run_to(600);
  CHECK(two.outcome(two.ace).duration_s == doctest::Approx(0.5));
  two.run_to(1050);
  CHECK(two.outcome(two.ace).state == action_state::under_way);  // although its end is settled
  CHECK(two.at("bottle", "closed", 1099) == "true");
  CHECK(two.at("bottle", "closed", 1100) == "false");
  two.run_to(1100);
  CHECK(two.outcome(two.ace).state == action_state::done);
  CHECK(two.outcome(two.ace).number == 7);
  CHECK(two.outcome(two.ace).duration_s == doctest::Approx(1.0));
  two.ace.actions().command(action_command(7, "open", "bottle"), kEpoch + 1150 * kMs);  // repeated, not given again
  two.run_to(3000);
  CHECK(two.outcome(two.ace).state == action_state::done);
  two.ace.actions().command(action_command(8, "fill", "cup", "bottle"), kEpoch + 3000 * kMs);
  two.run_to(6000);
  CHECK(two.outcome(two.ace).state == action_state::done);
  CHECK(two.at("cup", "level", 5100) == "full");
  CHECK(two.at("bottle", "level", 5099) == "full");
  CHECK(two.at("bottle", "level", 5100) == "empty");
}

TEST_CASE("an action that cannot be is refused with the reason and what is valid") {
  CHECK(has(refusal(action_command(1, "fly", "cup")), "no action `fly`; valid are: open, fill, take"));
  CHECK(
      has(refusal(action_command(1, "open", "jar")), "no object `jar` to be bottle `bottle`; valid are: cup, bottle"));
  CHECK(has(refusal(action_command(1, "open", "cup")), "`cup` is of type cup, and `bottle` of `open` is bottle"));
  CHECK(has(refusal(action_command(1, "open", "bottle", "cup")), "`open` has 1 roles: `cup` is too much"));
  CHECK(has(refusal(action_command(1, "fill", "cup")), "no object `` to be bottle `source`"));
  CHECK(has(refusal(action_command(1, "fill", "cup", "bottle")), "bottle.closed is true and not false"));
  CHECK(has(refusal(action_command(1, "move_crate", "crate")), "crate is 4.27 m away"));
  CHECK(has(refusal(action_command(1, "whisper", "crate")), "crate is 4.27 m away, and the reach is 4.2 m"));
  CHECK(has(refusal(action_command(1, "take", "cup"), R"(<event at="50ms" object="cup" to="away"/>)"),
            "cup is not here any more"));
  ActionCommand endless = action_command(1, "open", "bottle");
  std::memset(endless.action, 'x', sizeof endless.action);  // nobody ended it
  CHECK(has(refusal(endless), "xxxx`"));
}

TEST_CASE("an action may have a reach of its own") {
  Two two;
  two.ace.actions().command(action_command(1, "call", "crate"), kEpoch);
  two.run_to(1500);
  CHECK(two.outcome(two.ace).state == action_state::done);
}

TEST_CASE("an action fails, and changes nothing, if the world has changed at its end") {
  Two two(R"(<event at="1900ms" object="bottle" attr="level" value="empty"/>)");
  two.ace.actions().command(action_command(1, "open", "bottle"), kEpoch);
  two.run_to(1150);
  two.ace.actions().command(action_command(2, "fill", "cup", "bottle"), kEpoch + 1150 * kMs);
  two.run_to(4000);
  CHECK(two.outcome(two.ace).state == action_state::failed);
  CHECK(has(two.outcome(two.ace).reason, "bottle.level is empty and not full"));
  CHECK(two.outcome(two.ace).duration_s == doctest::Approx(2.0));
  CHECK(two.at("cup", "level", 4000) == "empty");
}

TEST_CASE("a robot that drives away meanwhile fails, and a new command gives up the old one") {
  Two two;
  two.ace.actions().command(action_command(1, "open", "bottle"), kEpoch);
  for (int64_t ms = 0; ms <= 2000; ms += 50) {
    two.ace.command_base(-0.5, 0, kEpoch + ms * kMs);
    two.ace.advance_base(kEpoch + ms * kMs);
    two.bea.advance_base(kEpoch + ms * kMs);
    two.run_to(ms);
  }
  CHECK(two.outcome(two.ace).state == action_state::failed);
  CHECK(has(two.outcome(two.ace).reason, "the reach is 0.8 m"));
  two.bea.actions().command(action_command(1, "open", "bottle"), kEpoch + 2000 * kMs);
  two.run_to(2500);
  two.bea.actions().command(action_command(2, "take", "cup"), kEpoch + 2500 * kMs);
  two.run_to(6000);
  CHECK(two.outcome(two.bea).number == 2);
  CHECK(two.outcome(two.bea).state == action_state::done);
  CHECK(two.at("bottle", "closed", 6000) == "true");
}

TEST_CASE("a cup is taken along, put on a table, and taken out of the world") {
  Two two;
  two.ace.actions().command(action_command(1, "take", "cup"), kEpoch);
  two.run_to(700);
  CHECK(two.ace.position("cup", kEpoch + 700 * kMs) == Vec2(1.5, 2.7));
  CHECK(two.ace.stage().placed(0, kEpoch + 700 * kMs)->shape->empty());
  two.ace.actions().command(action_command(2, "put", "cup", "table"), kEpoch + 700 * kMs);
  two.run_to(1400);
  CHECK(two.outcome(two.ace).state == action_state::done);
  CHECK(two.ace.position("cup", kEpoch + 1400 * kMs) == Vec2(0.95, 3.25));
  const auto placed = two.ace.stage().placed(0, kEpoch + 1400 * kMs);
  CHECK(placed->lift_m + placed->shape->box->z_m == doctest::Approx(0.7));
  two.bea.actions().command(action_command(1, "drop", "cup"), kEpoch + 1400 * kMs);
  two.run_to(1600);
  CHECK(two.outcome(two.bea).state == action_state::done);
  CHECK_FALSE(two.ace.position("cup", kEpoch + 1500 * kMs));
}

TEST_CASE("of two robots at one bottle the one that ends first has it, in whatever order their jobs run") {
  for (const bool ace_first : {true, false}) {
    CAPTURE(ace_first);
    for (const int64_t bea_after : {int64_t{-20}, int64_t{0}, int64_t{20}}) {
      CAPTURE(bea_after);
      Two two(R"(<event at="10ms" object="bottle" attr="closed" value="false"/>)");
      two.run_to(1000, ace_first);
      two.ace.actions().command(action_command(1, "fill", "cup", "bottle"), kEpoch + 1020 * kMs);
      two.bea.actions().command(action_command(1, "fill", "cup", "bottle"), kEpoch + (1020 + bea_after) * kMs);
      two.run_to(4000, ace_first);
      Simulation &winner = bea_after < 0 ? two.bea : two.ace, &loser = bea_after < 0 ? two.ace : two.bea;
      CHECK(two.outcome(winner).state == action_state::done);
      CHECK(two.outcome(loser).state == action_state::failed);
      CHECK(two.at("cup", "level", 3120 + std::min<int64_t>(bea_after, 0)) == "full");
      CHECK(two.at("cup", "level", 3119 + std::min<int64_t>(bea_after, 0)) == "empty");
    }
  }
}

TEST_CASE("what is settled is known before it happens, and nobody waits for a robot that does nothing any more") {
  Two two;
  two.ace.actions().command(action_command(1, "open", "bottle"), kEpoch);
  two.run_to(950);
  CHECK(two.stage->settled(kEpoch + 1050 * kMs));
  CHECK_FALSE(two.stage->settled(kEpoch + 1051 * kMs));
  two.run_to(1000);
  two.run_to(1050);
  CHECK(two.at("bottle", "closed", 1100) == "false");
  CHECK(two.stage->settled(kEpoch + 1150 * kMs));
  two.bea.actions().stop();
  two.ace.actions().command(action_command(2, "fill", "cup", "bottle"), kEpoch + 1100 * kMs);
  for (int64_t ms = 1100; ms <= 3100; ms += 50) two.ace.actions().advance(kEpoch + ms * kMs);
  CHECK(two.at("cup", "level", 3200) == "full");  // 100 ms before its time
  CHECK(two.stage->settled(kEpoch + 3200 * kMs));
}

TEST_CASE("a robot whose jobs have stopped is waited for half a second, at each instant that matters") {
  Two two;
  two.ace.actions().command(action_command(1, "open", "bottle"), kEpoch);
  for (int64_t ms = 0; ms <= 1600; ms += 50) {
    two.ace.actions().advance(kEpoch + ms * kMs);  // none of bea
    CHECK((two.ace.actions().outcome(kEpoch + ms * kMs).state == action_state::done) == (ms >= 1600));
  }
  CHECK(two.at("bottle", "closed", 1100) == "false");
}

TEST_CASE("many commands in a short time: those that end before the next begins are carried out") {
  Two two;
  for (uint32_t i = 1; i <= 8; ++i)
    CHECK(two.ace.actions().command(action_command(i, i % 2 == 1 ? "drop" : "take", "cup"),
                                    kEpoch + static_cast<int64_t>(i) * kMs) == (i <= 7));
  two.run_to(1000);
  // Dropped before it could be taken, so that what came then found no cup.
  CHECK_FALSE(two.ace.position("cup", kEpoch + 101 * kMs));
}
