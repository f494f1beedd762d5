// SPDX-License-Identifier: Apache-2.0
// The node on its ports: tasks from both sides, what survives a restart, what it does not believe.
#include <doctest/doctest.h>

#include <cstring>
#include <numbers>
#include <set>

#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/graph_folder.hpp"

namespace takt {
void register_robot_client(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

OutputPort& output(Node& node, std::string_view name) {
  for (OutputPort* port : node.outputs())
    if (port->name() == name) return *port;
  throw std::logic_error("no output " + std::string(name));
}

struct Fixture {
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<RobotTask>> taken;
  std::unique_ptr<test::BoxWriter<TextStatus>> status, speech, plan;
  std::unique_ptr<test::BoxWriter<ObjectReports>> map;
  std::unique_ptr<test::BoxWriter<VelocityCommand>> velocity;
  std::unique_ptr<test::BoxWriter<ActionCommand>> action;
  test::Box<Odometry> odometry;
  test::Box<RobotTask> task{Capacity{0, 0, 1, 100}};
  test::Box<ObjectReports> objects{Capacity{0, 0, 1, 4}};
  VirtualClock clock;
  uint64_t jobs = 0, sequence = 0;
  std::string said;

  Fixture() {
    NodeTypes types;
    register_robot_client(types);
    node = types.find("robot_client")->make();
    test::set(*node, "network", (takt::test::graph_folder() / "networks/kitchen.yaml").string());
    for (const char* name : {"odometry", "task", "objects"}) PortAccess::connect(test::input(*node, name), {});
    test::set_up(*node);
    node->end_setup();
    taken = std::make_unique<test::BoxWriter<RobotTask>>(output(*node, "taken"));
    status = std::make_unique<test::BoxWriter<TextStatus>>(output(*node, "status"));
    speech = std::make_unique<test::BoxWriter<TextStatus>>(output(*node, "speech"));
    plan = std::make_unique<test::BoxWriter<TextStatus>>(output(*node, "plan"));
    map = std::make_unique<test::BoxWriter<ObjectReports>>(output(*node, "map"));
    velocity = std::make_unique<test::BoxWriter<VelocityCommand>>(output(*node, "velocity"));
    action = std::make_unique<test::BoxWriter<ActionCommand>>(output(*node, "action"));
  }
  void say(uint32_t number, std::string_view text) {
    task->number = number;
    task->text.resize(text.size());
    std::copy(text.begin(), text.end(), task->text.data());
  }
  /// One job at 15 Hz, the robot where its odometry said `odometry_age_ns` ago.
  void step(int64_t odometry_age_ns = 0) {
    const int64_t release = kSecond + static_cast<int64_t>(jobs) * kSecond / 15;
    test::latch(test::input(*node, "odometry"), odometry, release - odometry_age_ns, ++sequence);
    test::latch(test::input(*node, "task"), task, release, sequence);
    taken->clear(), status->clear(), speech->clear(), plan->clear(), map->clear(), velocity->clear(), action->clear();
    Job job(clock, jobs++, release, release + kSecond / 15, 0, "full");
    node->run(job);
    if (speech->sent()) said += text(speech->message().text) + "\n";
  }
  static std::string text(const Array<char>& array) { return {array.data(), array.size}; }
  std::string state() { return text(status->message().text); }
};

}  // namespace

TEST_CASE("a task counts once, until another number comes; the parameter is a second way in") {
  Fixture f;
  f.say(0, "");
  f.step();
  CHECK(f.state() == "IDLE");
  CHECK(f.map->sent());  // what the network says, for who asks
  CHECK(f.map->message().names.size == 3);
  f.say(4, "drive 3 0");
  f.step();
  CHECK(f.taken->message().number == 4);
  CHECK(Fixture::text(f.taken->message().text) == "drive 3 0");
  for (int i = 0; i < 5; ++i) f.step();
  CHECK(f.state().find("DRIVE | drive 3 0") == 0);
  CHECK(f.velocity->message().speed_m_s > 0);
  test::set(*f.node, "task", std::string("17 stop"));
  f.step();
  CHECK(f.said.find("I leave off: drive 3 0") != std::string::npos);
  CHECK(f.state() == "IDLE");
  for (int i = 0; i < 5; ++i) f.step();
  CHECK(f.state() == "IDLE");  // number 4 is still on the port
  test::set(*f.node, "task", std::string("18 drive 3 0"));
  for (int i = 0; i < 3; ++i) f.step();
  CHECK(f.state().find("DRIVE") == 0);
}

TEST_CASE("without a new pose the robot stands, and says so") {
  Fixture f;
  f.say(1, "drive 3 0");
  for (int i = 0; i < 8; ++i) f.step();
  CHECK(f.velocity->message().speed_m_s > 0);
  f.step(kSecond);
  CHECK(f.velocity->sent());
  CHECK(f.velocity->message().speed_m_s == 0);
  CHECK(f.state().find("DRIVE | halted") == 0);
}

TEST_CASE("objects are believed, in the map frame and, where the pose at their stamp is known, in the robot's") {
  Fixture f;
  f.odometry->x_m = 5, f.odometry->theta_rad = std::numbers::pi / 2;  // looks along the map's y axis
  f.step();
  std::strcpy(f.objects->names.data()[0].name, "cup_7");
  std::strcpy(f.objects->names.data()[0].type, "cup");
  f.objects->names.resize(1);
  f.objects->places.push_back({1, 2, 0, 0, 1, 2});
  f.objects->attributes.resize(2);
  std::strcpy(f.objects->attributes[0].name, "level");
  std::strcpy(f.objects->attributes[0].value, "full");
  std::strcpy(f.objects->attributes[1].name, "taste");
  std::strcpy(f.objects->attributes[1].value, "sweet");
  const auto show = [&](uint8_t in_map, int64_t stamp_ns) {
    f.objects->in_map = in_map;
    test::latch(test::input(*f.node, "objects"), f.objects, stamp_ns, ++f.sequence);
    f.step();
    return f.map->sent();
  };
  CHECK_FALSE(show(0, 20 * kSecond));  // nobody knows yet where the robot will be
  CHECK(show(0, kSecond));
  const ObjectReports& map = f.map->message();
  REQUIRE(map.names.size == 4);
  CHECK(std::string(map.names[3].name) == "cup_7");
  CHECK(map.places[3].attributes == 1);  // the network knows no taste
  CHECK(map.places[3].x_m == doctest::Approx(6));
  CHECK(map.places[3].y_m == doctest::Approx(2));
  CHECK_FALSE(show(0, kSecond));  // the same once more
  CHECK(show(1, kSecond + 1));
  CHECK(map.places[3].x_m == doctest::Approx(1));
}

TEST_CASE("what was removed stays removed over a restart, what was added is there") {
  Fixture before;
  before.say(4, "remove cup_1");
  before.step();
  before.say(5, "add bottle bottle_7 1 2");
  before.step();
  CHECK(before.map->message().names.size == 3);
  Fixture after;
  PortAccess::hand_over(output(*after.node, "map"), &before.map->message());
  after.node->start(kSecond);
  after.step();
  std::set<std::string> names;  // in the order of ids, which are given anew
  for (const ObjectName& name : after.map->message().names.items()) names.insert(name.name);
  CHECK(names == std::set<std::string>{"bottle_1", "bottle_2", "bottle_7"});
}

TEST_CASE("a restarted node goes on with its map, its numbers, and a task that names an end") {
  for (const char* words : {"goal cup_1.level=full", "ahead 3"}) {
    CAPTURE(words);
    Fixture before;
    before.say(4, words);
    before.step();
    before.action->message().number = 9;
    Fixture after;
    PortAccess::hand_over(output(*after.node, "taken"), &before.taken->message());
    PortAccess::hand_over(output(*after.node, "map"), &before.map->message());
    PortAccess::hand_over(output(*after.node, "action"), &before.action->message());
    after.node->start(kSecond);
    after.say(4, words);
    after.step();
    const bool goal = words[0] == 'g';
    CHECK(Fixture::text(after.taken->message().text) == (goal ? words : ""));
    CHECK(after.taken->message().number == 4);
    CHECK(after.action->message().number == 9);
    after.step();
    CHECK((after.state() == "IDLE") != goal);
  }
}
