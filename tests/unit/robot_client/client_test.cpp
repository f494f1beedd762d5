// SPDX-License-Identifier: Apache-2.0
// The client in a world of a few lines: a robot that does exactly what it is told, 0.2 s later, an actor that carries
// the kitchen's actions out, and eyes that see everything.
#include "nodes/robot_client/client.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <numbers>

#include "nodes/semantic/network_file.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/time/clock.hpp"
#include "tests/unit/planner/cup_and_bottles.hpp"

using namespace takt;
using namespace takt::robot_client;

namespace {

constexpr double kStep_s = 1.0 / 15;
constexpr semantic::MapParameters kSmall{{100, 300}, 0.3, 100, 100, -15, -15};

/// The closed bottle is within reach of the cup; the open one stands at `bottle_2`.
std::string kitchen(const std::string& bottle_2) { return test::cup_and_bottles("[3m, 0m]", "[3m, 1m]", bottle_2); }

class Stage {
 public:
  explicit Stage(const std::string& network, ClientParameters parameters = {}, size_t cells = 0)
      : knowledge(kSmall), truth(kSmall), client(knowledge, with(parameters, cells)) {
    REQUIRE(semantic::parse_network(network, "n.yaml", knowledge.map()));
    REQUIRE(semantic::parse_network(network, "n.yaml", truth.map()));
  }

  void step() {
    now_ns += std::llround(kStep_s * 1e9);
    if (!cells.empty()) REQUIRE(client.look({{cells.data(), width, height}, 0.2, -2, -4}));
    if (eyes) report();
    Percept p;
    p.now_ns = now_ns;
    p.dt_s = kStep_s;
    if (odometry) p.robot = robot;
    p.stop = stop;
    p.obstacle = obstacle;
    p.outcome = {outcome.number, outcome.state, outcome.duration_s, reason};
    p.effort.expansions = 50;
    velocity = client.step(p);
    const navigation::Velocity now = std::exchange(on_their_way[step_++ % on_their_way.size()], velocity);
    robot = compose(robot, {now.speed_m_s * kStep_s, 0, now.turn_rad_s * kStep_s});
    driven_m += std::abs(now.speed_m_s) * kStep_s;
    act();
    said += client.speech();
    said += said.empty() || said.back() == '\n' ? "" : "\n";
    if (on_step) on_step();
  }
  /// Until the task is over, at most `s`.
  void finish(double s = 120) {
    for (double t = 0; t < s && !client.task().empty(); t += kStep_s) step();
    REQUIRE_MESSAGE(client.task().empty(), said);
    for (int i = 0; i < 30; ++i) step();
  }
  void run(std::string_view task, double s = 120) {
    client.take(task);
    finish(s);
  }
  bool holds(std::string_view object, std::string_view attribute, std::string_view value) const {
    const auto& map = truth.map();
    const NodeId a = map.network().find(attribute);
    return map.state(map.network().find(object), a) == *semantic::parse_value(map.attribute(a), value);
  }
  void make(std::string_view object, std::string_view attribute, std::string_view value) {
    const NodeId a = truth.map().network().find(attribute);
    truth.map().set_state(truth.map().network().find(object), a,
                          *semantic::parse_value(truth.map().attribute(a), value));
  }
  bool has_said(std::string_view text) const { return said.find(text) != std::string::npos; }

  Knowledge knowledge, truth;
  Client client;
  PlanarPose robot;
  navigation::Velocity velocity;
  int64_t now_ns = 1'000'000'000;
  bool eyes = true, odometry = true, stop = false, obstacle = false, actor = true;
  std::string refuse, said, done;  ///< `done`: actions, in their order
  double slowness = 1, driven_m = 0;
  std::function<void()> on_step;
  std::vector<int16_t> cells;
  int width = 0, height = 0;

 private:
  static ClientParameters with(ClientParameters parameters, size_t cells) {
    parameters.driving.most_cells = parameters.deliberation.most_cells = cells;
    return parameters;
  }
  void report() {
    auto& map = truth.map();
    for (const NodeId node : map.all(semantic::Kind::object)) {
      const semantic::Object& o = map.object(node);
      std::vector<std::string> values;
      std::vector<ReportedState> states;
      values.reserve(o.state_count);
      for (const auto& state : std::span(o.states).first(o.state_count)) {
        values.push_back(semantic::to_text(map.attribute(state.attribute), state.value));
        states.push_back({truth.name(state.attribute), values.back()});
      }
      const auto types = map.network().omega(node, semantic::Kind::type);
      knowledge.see({truth.name(node), truth.name(types[0]), o.x_m, o.y_m, 1, now_ns}, states);
    }
    client.note_news();
  }
  /// As the simulated world's: near enough to all objects and with all requirements, for as long as the action costs.
  void act() {
    const Command& command = client.command();
    if (!actor || command.number == 0) return;
    const auto& action = truth.map().action(command.deed.action);
    if (command.number != outcome.number) {
      const auto places = truth.places(truth.objects_of(command.deed));
      bool near = true;
      for (const auto& place : places) near &= std::hypot(place.x_m - robot.x_m, place.y_m - robot.y_m) <= 0.8;
      reason = !near ? "too far away" : refuse;
      if (reason.empty() && !truth.map().possible(action, truth.objects_of(command.deed))) reason = "it cannot be done";
      outcome = {command.number, reason.empty() ? action_state::under_way : action_state::refused, 0, {}};
    } else if (outcome.state == action_state::under_way) {
      outcome.duration_s += kStep_s;
      if (outcome.duration_s < slowness * action.cost_s) return;
      outcome.state = action_state::done;
      truth.map().apply(action, truth.objects_of(command.deed));
      done += (done.empty() ? "" : "; ") + truth.to_text(command.deed);
    }
  }
  Outcome outcome;
  std::string reason;
  std::array<navigation::Velocity, 3> on_their_way{};
  size_t step_ = 0;
};

}  // namespace

TEST_CASE("cup and bottles in both cost orders, driven and done") {
  Stage near(kitchen("[3.5m, -1m]"));
  near.run("goal cup_1.level=full");
  CHECK(near.done == "fill cup_1 bottle_2");
  CHECK(near.holds("cup_1", "level", "full"));
  CHECK(near.has_said("goal cup_1.level=full: done"));

  Stage far(kitchen("[9m, -1m]"));  // no place is within reach of cup and bottle
  far.run("goal cup_1.level=full");
  CHECK(far.done == "open bottle_1; fill cup_1 bottle_1");
  CHECK(far.client.mode() == Mode{});
  far.run("goal cup_1.level=full");
  CHECK(far.has_said("it is so already"));
}

TEST_CASE("foreseen and taken times of every step agree within 20 %") {
  Stage stage(kitchen("[9m, -1m]"));
  stage.run("goal cup_1.level=full");
  const auto records = stage.client.records();
  REQUIRE(records.size() == 2);
  for (const StepRecord& r : records) {
    MESSAGE("drive " << r.drive_s << " s, took " << r.drive_took_s << "; act " << r.action_s << " s, took "
                     << r.action_took_s);
    CHECK(r.drive_took_s == doctest::Approx(r.drive_s).epsilon(0.2));
    CHECK(r.action_took_s == doctest::Approx(r.action_s).epsilon(0.2));
  }
  std::string text;
  stage.client.write_plan(text);
  CHECK(text.find("1. open bottle_1: drive") == 0);
  CHECK(text.find("(took ") != std::string::npos);
}

TEST_CASE("what actions take is learned, and changes the plan") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.slowness = 3;
  stage.run("goal cup_1.level=full");
  const NodeId fill = stage.knowledge.map().network().find("fill");
  CHECK(stage.client.costs().cost_s(fill, 6) == doctest::Approx(12).epsilon(0.02));
}

TEST_CASE("a sudden change of a state is noticed on the way, and planned round") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.on_step = [&] {
    if (stage.client.mode().state == State::drive && stage.robot.x_m > 1) stage.make("bottle_2", "level", "empty");
  };
  stage.run("goal cup_1.level=full");
  CHECK(stage.done == "open bottle_1; fill cup_1 bottle_1");
  CHECK(stage.has_said("bottle_2.level is empty, and not full; I plan again"));
}

TEST_CASE("an action whose result does not show is tried again, and given up with a reason") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.on_step = [&] {  // the cup leaks, the bottle refills
    stage.make("cup_1", "level", "empty");
    stage.make("bottle_2", "level", "full");
  };
  stage.run("goal cup_1.level=full", 300);
  CHECK(stage.done == "fill cup_1 bottle_2; fill cup_1 bottle_2; fill cup_1 bottle_2");
  CHECK(stage.has_said("given up after 3 plans: cup_1.level is empty, and not full"));
  CHECK(stage.client.mode() == Mode{});
}

TEST_CASE("what nobody looks at after an action is as the action leaves it") {
  Stage stage(kitchen("[9m, -1m]"));
  stage.eyes = false;
  stage.run("goal cup_1.level=full");
  CHECK(stage.done == "open bottle_1; fill cup_1 bottle_1");
  CHECK(stage.has_said(": done"));
}

TEST_CASE("refused actions, and actors that do not answer, are reasons") {
  Stage refused(kitchen("[3.5m, -1m]"));
  refused.refuse = "the hand is full";
  refused.run("goal cup_1.level=full", 300);
  CHECK(refused.has_said("given up after 3 plans: fill cup_1 bottle_2: the hand is full"));
  Stage silent(kitchen("[3.5m, -1m]"));
  silent.actor = false;
  silent.run("do fill cup_1 bottle_2");
  CHECK(silent.has_said("nobody takes the action up"));
}

TEST_CASE("what cannot be meant or reached says why") {
  struct Wrong {
    const char *task, *why;
  };
  Stage stage(kitchen("[9m, -1m]"));
  for (const Wrong& w :
       {Wrong{"goal cup_2.level=full", "there is no object cup_2; known are: cup_1, bottle_1, bottle_2"},
        {"goal cup_1.closed=true", "cup_1 has no attribute closed; it has: level"},
        {"goal bottle_1.level=half", "empty, full"},
        {"goal bottle_2.closed=true", "no plan leads there"},
        {"do fill cup_1 bottle_1 cup_1", "fill wants 2 objects, and got 3"},
        {"do fill bottle_1 cup_1", "bottle_1 is no cup, which fill wants as its c"},
        {"do pour cup_1 bottle_1", "there is no action pour; known are: open, fill"},
        {"dance", "\"dance\" is no task"}}) {
    stage.said.clear();
    stage.run(w.task);
    CAPTURE(stage.said);
    CHECK(stage.has_said(w.why));
  }
}

TEST_CASE("drive, rotate, ahead, do: out of IDLE and back") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.run("drive 2 1");
  CHECK(std::hypot(stage.robot.x_m - 2, stage.robot.y_m - 1) < 0.05);
  const double before_rad = stage.robot.theta_rad;
  stage.run("rotate 90deg");
  CHECK(std::abs(wrapped(stage.robot.theta_rad - before_rad - std::numbers::pi / 2)) < 0.035);
  const PlanarPose from = stage.robot;
  stage.run("ahead -0.5");
  CHECK(between(from, stage.robot).x_m == doctest::Approx(-0.5).epsilon(0.1));
  stage.run("do fill cup_1 bottle_2");
  CHECK(stage.done == "fill cup_1 bottle_2");
  CHECK(stage.holds("cup_1", "level", "full"));
}

TEST_CASE("a task ends the one before, stop ends it too, telling does not") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.client.take("drive 9 0");
  for (int i = 0; i < 30; ++i) stage.step();
  CHECK(stage.velocity.speed_m_s > 0.5);
  stage.client.take("tell bottle_1.closed=false");
  CHECK(stage.client.task() == "drive 9 0");
  stage.client.take("drive 0 0");
  stage.finish();
  CHECK(stage.has_said("I leave off: drive 9 0"));
  CHECK(std::hypot(stage.robot.x_m, stage.robot.y_m) < 0.05);
  stage.client.take("drive 9 0");
  for (int i = 0; i < 30; ++i) stage.step();
  stage.client.take("stop");
  CHECK(stage.client.task().empty());
  for (int i = 0; i < 30; ++i) stage.step();
  CHECK(stage.velocity.speed_m_s == 0);
  CHECK(stage.client.mode() == Mode{});
}

TEST_CASE("what is told counts at once, and is planned with") {
  Stage stage(kitchen("[9m, -1m]"));
  stage.eyes = false;
  stage.make("bottle_1", "closed", "false");
  stage.client.take("tell bottle_1.closed=false");
  stage.run("goal cup_1.level=full");
  CHECK(stage.done == "fill cup_1 bottle_1");
}

TEST_CASE("objects are added, moved and removed by hand; what is under way goes on") {
  Stage stage(kitchen("[9m, -1m]"));
  stage.eyes = false;
  const auto& map = stage.knowledge.map();
  stage.client.take("drive 9 0");
  stage.client.take("add cup cup_3 1.5 2");
  stage.step();
  CHECK(stage.has_said("I believe that cup cup_3 is at 1.50 m, 2.00 m"));
  CHECK(stage.client.task() == "drive 9 0");
  const NodeId cup = map.network().find("cup_3");
  REQUIRE(cup != kNoNode);
  CHECK(map.object(cup).x_m == 1.5);
  const uint32_t revision = stage.knowledge.revision();
  stage.client.take("move cup_3 1 -2");
  CHECK(map.object(cup).y_m == -2);
  CHECK(stage.knowledge.revision() > revision);
  for (const auto& [words, said] : {std::pair("add cup cup_3 0 0", "another node has this name"),
                                    {"add cup fill 0 0", "another node has this name"},
                                    {"add lamp lamp_1 0 0", "there is no type lamp; known are: "},
                                    {"add cup cup_4 9999 0", "lies outside of the map"},
                                    {"move cup_3 9999 0", "lies outside of the map"},
                                    {"move cup 1 1", "there is no object cup; known are: "},
                                    {"remove cup_4", "there is no object cup_4; known are: "}}) {
    CAPTURE(words);
    stage.client.take(words);
    stage.step();
    CHECK(stage.has_said(said));
  }
  CHECK(map.object(cup).x_m == 1);
  stage.client.take("remove cup_3");
  stage.step();
  CHECK(stage.has_said("I believe that there is no cup_3"));
  CHECK(map.network().find("cup_3") == kNoNode);
}

TEST_CASE(
    "an object that a goal may need stays until the goal is over; then nothing tells of it, and its id is another's") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.client.take("goal cup_1.level=full");
  stage.client.take("remove bottle_2");
  stage.finish();
  CHECK(stage.has_said("bottle_2 stays until this is over: goal cup_1.level=full"));
  REQUIRE(stage.done == "fill cup_1 bottle_2");
  stage.eyes = stage.actor = false;
  stage.client.take("remove bottle_2");
  stage.client.take("add cup cup_9 1 1");
  stage.step();
  CHECK(stage.client.records().empty());
  CHECK(stage.client.command().deed.action == kNoNode);
  std::string plan;
  stage.client.write_plan(plan);
  CHECK(plan == "no plan");
}

TEST_CASE("emergency: without a pose, and while it has to stop, the robot stands at once; then it goes on") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.client.take("goal cup_1.level=full");
  for (bool Stage::*cause : {&Stage::odometry, &Stage::stop}) {
    for (int i = 0; i < 25; ++i) stage.step();
    REQUIRE(stage.velocity.speed_m_s > 0.3);
    stage.*cause = !(stage.*cause);
    for (int i = 0; i < 300; ++i) {
      stage.step();
      CHECK(stage.velocity.speed_m_s == 0);
      CHECK(stage.velocity.turn_rad_s == 0);
    }
    std::string status;
    stage.client.write_status(status);
    CHECK(status.find("DRIVE | halted") == 0);
    stage.*cause = !(stage.*cause);
    stage.step();
    CHECK(stage.velocity.speed_m_s < 0.1);  // from 0 on again
  }
  stage.finish();
  CHECK(stage.done == "fill cup_1 bottle_2");
}

TEST_CASE("made to stand before an obstacle the robot waits, draws back and drives on; a few times, then it says so") {
  for (const bool goes_away : {true, false}) {
    CAPTURE(goes_away);
    Stage stage(kitchen("[3.5m, -1m]"));
    stage.obstacle = true;
    int drawn_back = 0;
    double stood_s = 0, nearest_m = 10;
    stage.on_step = [&] {  // as the guard: it may leave what it may not drive on to
      const bool back = stage.velocity.speed_m_s < 0;
      const bool there = stage.robot.x_m > 1 && !(goes_away && drawn_back == 1);
      if (stage.stop && back) ++drawn_back;
      if (drawn_back == 0 && stage.stop) stood_s += kStep_s;
      if (drawn_back > 0) nearest_m = std::min(nearest_m, stage.robot.x_m);
      CHECK(stage.velocity.speed_m_s >= -0.15);
      stage.stop = there && !back;
    };
    stage.run("drive 3 0");
    CHECK(stood_s == doctest::Approx(2).epsilon(0.1));  // it might have gone away
    CHECK(nearest_m > 0.6);
    CHECK(drawn_back == (goes_away ? 1 : 3));
    CHECK((std::abs(stage.robot.x_m - 3) < 0.05) == goes_away);
    CHECK(stage.has_said("drive 3 0: an obstacle stands in the way") != goes_away);
    CHECK(stage.client.mode() == Mode{});
  }
}

TEST_CASE("a guard that lets go of who stands, and stops who moves, does not keep the robot for ever") {
  Stage stage(kitchen("[3.5m, -1m]"));
  stage.obstacle = true;
  double held_s = 0;
  int stops = 0;
  stage.on_step = [&] {
    stage.robot.x_m = std::min(stage.robot.x_m, 1.05);  // there it stands before the obstacle
    held_s = std::max(0.0, held_s - kStep_s);
    if (stage.robot.x_m > 1 && stage.velocity.speed_m_s > 0) held_s = 0.5;
    if (held_s > 0 && !stage.stop) ++stops;
    stage.stop = held_s > 0 && stage.velocity.speed_m_s >= 0;
  };
  stage.run("drive 3 0");
  CHECK(stops > 10);
  CHECK(stage.has_said("drive 3 0: an obstacle stands in the way"));
}

namespace {

/// 8 m x 8 m in cells of 0.2 m, the corner at (-2, -4); a wall at x 1.6 m with a door between y 0.6 and 2.4 m, and one
/// farther up.
void build_room(Stage& stage, bool door, bool other_door) {
  stage.width = stage.height = 40;
  stage.cells.assign(1600, 0);
  for (int row = 0; row < 40; ++row) {
    const bool open = (door && row >= 20 && row < 32) || (other_door && row < 12);
    if (!open) stage.cells[static_cast<size_t>(row * 40 + 18)] = 1000;
  }
}

}  // namespace

TEST_CASE("a door closed on the way: another is taken, and without one a reason is given") {
  for (const bool other_door : {true, false}) {
    CAPTURE(other_door);
    Stage stage(kitchen("[3.5m, -1m]"), {}, 1600);
    build_room(stage, true, other_door);
    stage.on_step = [&] {
      if (stage.robot.y_m > 0.3 || stage.robot.x_m > 0.6) build_room(stage, false, other_door);
    };
    stage.run("drive 4 0");
    CHECK((std::hypot(stage.robot.x_m - 4, stage.robot.y_m) < 0.05) == other_door);
    CHECK(stage.has_said("no way leads there") != other_door);
    if (!other_door) CHECK(stage.robot.x_m < 1.6);
  }
}

TEST_CASE("on a grid, too, goals are reached, and objects behind walls are known not to be") {
  Stage stage(kitchen("[3.5m, -1m]"), {}, 1600);
  build_room(stage, true, false);
  stage.run("goal cup_1.level=full");
  CHECK(stage.done == "fill cup_1 bottle_2");
  CHECK(stage.client.records()[0].drive_took_s == doctest::Approx(stage.client.records()[0].drive_s).epsilon(0.2));
  Stage shut(kitchen("[3.5m, -1m]"), {}, 1600);
  build_room(shut, false, false);
  shut.run("goal cup_1.level=full");
  CHECK(shut.done.empty());
  CHECK(shut.has_said("no plan leads there; cannot be got at: "));
  CHECK(shut.driven_m == 0);
}

TEST_CASE("a goal whose objects no way leads to is waited for, and reached once there is one") {
  Stage stage(kitchen("[3.5m, -1m]"), {}, 1600);
  build_room(stage, false, false);
  int steps = 0;
  stage.on_step = [&] {
    if (++steps == 80) build_room(stage, true, false);
  };
  stage.run("goal cup_1.level=full");
  CHECK(stage.has_said("; I look around and wait"));
  CHECK(stage.done == "fill cup_1 bottle_2");
}

TEST_CASE("exploring ends when nothing unknown that can be got to is near") {
  Stage stage(kitchen("[3.5m, -1m]"), {}, 1600);
  build_room(stage, true, false);
  const std::vector<int16_t> room = stage.cells;
  stage.cells.assign(1600, -1);
  stage.on_step = [&] {  // sees 1.5 m around
    for (int row = 0; row < 40; ++row)
      for (int column = 0; column < 40; ++column)
        if (std::hypot(-2 + 0.2 * (column + 0.5) - stage.robot.x_m, -4 + 0.2 * (row + 0.5) - stage.robot.y_m) < 1.5)
          stage.cells[static_cast<size_t>(row * 40 + column)] = room[static_cast<size_t>(row * 40 + column)];
  };
  stage.on_step();
  stage.run("explore", 900);
  CHECK(stage.has_said("explore: nothing unknown that can be got to is near"));
  const auto unknown = std::count(stage.cells.begin(), stage.cells.end(), int16_t{-1});
  MESSAGE(unknown << " of 1600 cells unknown in the end, " << stage.driven_m << " m driven");
  CHECK(unknown < 160);
  Stage without(kitchen("[3.5m, -1m]"));
  without.run("explore");
  CHECK(without.has_said("there is no grid"));
}

TEST_CASE("a portion of planning stays within its effort, and portions do not change the plan") {
  Stage stage(kitchen("[9m, -1m]"), {}, 1600);
  build_room(stage, true, false);
  navigation::PathPlanner ways(1600, {});
  REQUIRE(ways.look({{stage.cells.data(), 40, 40}, 0.2, -2, -4}));
  const auto goal = stage.knowledge.understand(FactText{"cup_1", "level", "full"});
  REQUIRE(goal);
  std::string texts[2];
  size_t portions[2] = {};
  for (const bool small : {true, false}) {
    DeliberationParameters p;
    p.most_cells = 1600;
    p.cells_a_portion = small ? 1 : 1'000'000;
    p.most_portions = 1000;
    Deliberation deliberation(stage.knowledge, p);
    REQUIRE(deliberation.begin({&*goal, 1}, {}, {}));
    planner::Effort effort;
    if (small) effort.expansions = 1;
    while (!deliberation.go_on(&ways, effort)) {
    }
    portions[small] = deliberation.portions();
    REQUIRE(deliberation.plan().exists());
    CHECK(deliberation.plan().verdict == planner::Verdict::best);
    for (const auto& step : deliberation.plan().steps)
      texts[small] += std::string(stage.knowledge.name(deliberation.domain().actions[step.action].action)) + " " +
                      std::to_string(step.drive_ns) + "; ";
  }
  CHECK(texts[0] == texts[1]);
  CHECK(portions[0] == 1);
  CHECK(portions[1] > 4);
}

TEST_CASE("standing by and driving take no memory") {
  Stage stage(kitchen("[9m, -1m]"), {}, 1600);
  build_room(stage, true, false);
  stage.eyes = false;
  stage.client.take("goal cup_1.level=full");
  for (int i = 0; i < 15; ++i) stage.step();
  REQUIRE(stage.client.mode() == Mode{State::drive, State::execute});
  std::string status;
  status.reserve(500);
  for (const bool stopped : {false, true}) {
    if (stopped) stage.client.take("stop");
    Percept p;
    p.robot = stage.robot;
    p.dt_s = kStep_s;
    stage.client.step(p);
    const uint64_t before = thread_memory_use().allocations;
    for (int i = 0; i < 20; ++i) {
      REQUIRE(stage.client.look({{stage.cells.data(), 40, 40}, 0.2, -2, -4}));
      stage.client.step(p);
      stage.client.write_status(status);
    }
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    CHECK(stage.client.mode().state == (stopped ? State::idle : State::drive));
  }
}

TEST_CASE("cost of a job" * doctest::skip()) {  // a figure and no check; run with --no-skip
  Stage stage(kitchen("[9m, -1m]"), {}, 1600);
  build_room(stage, true, false);
  stage.eyes = false;
  std::vector<double> of_state[kStates];
  for (int round = 0; round < 30; ++round) {
    stage.client.take(round % 2 == 0 ? "goal cup_1.level=full" : "tell cup_1.level=empty bottle_1.level=full");
    stage.make("cup_1", "level", "empty"), stage.make("bottle_1", "level", "full");
    for (int i = 0; i < 600 && !stage.client.task().empty(); ++i) {
      const State state = stage.client.mode().state;
      const int64_t begin = thread_cpu_ns();
      stage.step();
      of_state[static_cast<size_t>(state)].push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-6);
    }
  }
  for (size_t i = 0; i < kStates; ++i) {
    auto& ms = of_state[i];
    if (ms.empty()) continue;
    std::sort(ms.begin(), ms.end());
    MESSAGE(to_string(static_cast<State>(i))
            << ": median " << ms[ms.size() / 2] << " ms, longest " << ms.back() << " ms, " << ms.size() << " jobs");
  }
}
