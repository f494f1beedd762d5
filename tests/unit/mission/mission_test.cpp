// SPDX-License-Identifier: Apache-2.0
#include "nodes/mission/mission.hpp"

#include <doctest/doctest.h>

#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "nodes/mission/pointing.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/testing.hpp"

using namespace takt;
using namespace takt::mission;
using drive_arbiter::VisionState;
using navigation::OccupancyView;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// 20 m x 20 m around the origin, cells of 0.25 m, all free.
struct Ground {
  static constexpr int kCells = 80;
  static constexpr size_t kAll = kCells * kCells;
  std::vector<int16_t> cells = std::vector<int16_t>(kAll, 0);
  OccupancyView view() const { return {{cells.data(), kCells, kCells}, 0.25, -10, -10}; }
  /// Cells of a rectangle of the map, m.
  void fill(double x0, double y0, double x1, double y1, int16_t value) {
    for (int row = 0; row < kCells; ++row)
      for (int column = 0; column < kCells; ++column) {
        const double x = -10 + 0.25 * (column + 0.5), y = -10 + 0.25 * (row + 0.5);
        if (x >= x0 && x <= x1 && y >= y0 && y <= y1) cells[static_cast<size_t>(row * kCells + column)] = value;
      }
  }
};

/// A robot client that drives wherever it is told to at once, and turns so, one job after it was told.
struct Town {
  Ground ground;
  OccupancyView view = ground.view();
  MissionParameters parameters;
  WayAheadParameters ways;
  Mission mission{parameters, ways, Ground::kAll};
  Percept percept;
  uint32_t ended = 0;

  void step(double seconds = 0.2) {
    percept.now_ns += static_cast<int64_t>(seconds * 1e9);
    percept.over = ended;
    percept.grid = &view;
    mission.step(percept);
    percept.pointed_rad.reset();
    percept.sign.reset();
    percept.answer = {};
  }
  void touch(std::string_view answer) {
    percept.answer = answer;
    step();
  }
  std::string_view said() const { return mission.speech(); }
  /// Straight before the robot.
  void see_sign(double m) {
    const PlanarPose at = compose(percept.robot, {m, 0, 0});
    percept.sign = navigation::Place{at.x_m, at.y_m};
  }
  std::string told() const { return std::string(mission.task().text); }
  /// What it was told is over.
  void obey() {
    double x = 0, y = 0;
    if (std::sscanf(told().c_str(), "drive %lf %lf", &x, &y) == 2) percept.robot.x_m = x, percept.robot.y_m = y;
    if (std::sscanf(told().c_str(), "rotate %lf", &x) == 1)
      percept.robot.theta_rad = wrapped(percept.robot.theta_rad + x);
    ended = mission.task().number;
  }
  void ask_the_way(double pointed_rad) {
    percept.pedestrian = "anna";
    step();
    obey(), step();  // asked
    obey(), step();  // stepped back
    for (int i = 0; i < 8; ++i) percept.pointed_rad = pointed_rad, step();
  }
};

}  // namespace

TEST_CASE("the whole mission: asks, reads, drives, waits, follows, drives on") {
  Town town;
  town.percept.robot.theta_rad = -90 * kDegree;
  town.step();
  CHECK(town.mission.state() == State::seek);
  CHECK(town.mission.task().number == 0);
  town.percept.pedestrian = "anna";
  town.step();
  CHECK(town.told() == "do ask anna");
  town.percept.pedestrian_at = {0, -1};
  town.step();
  CHECK(town.mission.state() == State::ask);
  town.obey(), town.step();
  CHECK(town.told() == "ahead -1.60");
  town.obey(), town.step();
  CHECK(town.mission.state() == State::read);
  CHECK(vision_of(town.mission.state()) == VisionState::pose);
  for (int i = 0; i < 7; ++i) town.percept.pointed_rad = (i == 3 ? 170 : 10) * kDegree, town.step();
  CHECK(town.mission.state() == State::read);
  town.percept.pointed_rad = 10 * kDegree, town.step();
  REQUIRE(town.mission.direction_rad().has_value());
  CHECK(*town.mission.direction_rad() == doctest::Approx(10 * kDegree));
  CHECK(town.told() == "rotate 1.745");
  town.obey(), town.step();
  CHECK(town.mission.state() == State::drive);
  CHECK(vision_of(State::drive) == VisionState::search);
  town.step();
  CHECK(town.told() == "drive 3.45 0.61");  // 3.5 m along 10 degrees
  town.see_sign(3.6), town.step();
  CHECK(town.mission.state() == State::drive);
  town.see_sign(3.4), town.step();
  CHECK(town.mission.state() == State::face);
  CHECK(town.told() == "rotate 0.000");
  town.obey(), town.step();
  CHECK(town.mission.state() == State::follow);
  CHECK(vision_of(State::follow) == VisionState::tracking);
  town.step(10);  // whoever waits at the kerb stands, too
  CHECK(town.mission.state() == State::follow);
  town.percept.speed_m_s = 0.6, town.percept.robot.x_m += 6.3, town.step();
  town.percept.speed_m_s = 0, town.step();
  town.step(10);  // 3.4 m to the sign, and 3 m at least behind it
  CHECK(town.mission.state() == State::follow);
  town.percept.speed_m_s = 0.6, town.percept.robot.x_m += 0.2, town.step();
  town.percept.speed_m_s = 0, town.step();
  town.step(2.9);
  CHECK(town.mission.state() == State::follow);
  town.percept.robot.theta_rad = -20 * kDegree, town.step();
  CHECK(town.mission.state() == State::turn);
  CHECK(town.told() == "rotate 0.524");
  CHECK(town.mission.crossed() == 1);
  town.obey(), town.step();
  CHECK(town.mission.state() == State::drive);
  town.see_sign(1.0), town.step();  // of the crossing behind
  CHECK(town.mission.state() == State::drive);
  town.percept.robot.x_m += 4.1, town.step();
  CHECK(town.mission.state() == State::done);
  CHECK(town.told() == "stop");
}

TEST_CASE("who cannot be seen is looked for where he was seen last, then round about") {
  Town town;
  town.percept.pedestrian = "anna", town.percept.pedestrian_at = {0, 2};
  town.step();
  town.percept.pedestrian = {};
  town.obey(), town.step();
  town.obey(), town.step();
  REQUIRE(town.mission.state() == State::read);
  town.step(10);
  CHECK(town.told() == "rotate 6.283");
  town.obey(), town.step();
  REQUIRE(town.mission.state() == State::seek);
  town.step(1.8);
  CHECK(town.mission.state() == State::seek);
  town.step(0.3);
  CHECK(town.mission.state() == State::look);
  CHECK(town.told() == "rotate 1.571");
  town.obey(), town.step();
  CHECK(town.mission.state() == State::seek);
  town.step(2.1);
  CHECK(town.told() == "rotate 1.000");
  town.obey(), town.step();
  town.percept.pedestrian = "bert", town.step();
  CHECK(town.told() == "do ask bert");
}

TEST_CASE("a sign that was seen from afar is kept in mind where it is, until the robot is near it") {
  Town town;
  town.ask_the_way(0);
  town.obey(), town.step();
  town.step();
  REQUIRE(town.told() == "drive 3.50 0.00");
  town.see_sign(6.5), town.step();
  CHECK(town.mission.state() == State::drive);
  town.percept.robot.x_m = 2.9, town.step();
  CHECK(town.mission.state() == State::drive);
  town.percept.robot.x_m = 3.1, town.step();
  CHECK(town.mission.state() == State::face);
}

TEST_CASE("who does not point is asked again, three times") {
  Town town;
  town.percept.pedestrian = "anna";
  for (int i = 0; i < 3; ++i) {
    if (i > 0) {
      CHECK(town.mission.state() == State::look);
      CHECK(town.told() == "rotate 6.283");
      town.obey(), town.step();
    }
    town.step();
    CHECK(town.told() == "do ask anna");
    town.obey(), town.step();
    town.obey(), town.step();
    CHECK(town.mission.state() == State::read);
    town.step(9.9);
    CHECK(town.mission.state() == State::read);
    town.step();
  }
  CHECK(town.mission.state() == State::failed);
  CHECK(town.mission.trouble() == "nobody points the way");
  CHECK(town.told() == "stop");
}

TEST_CASE("whoever touches a direction on the screen is asked whether it was understood") {
  Town town;
  town.percept.robot.theta_rad = -90 * kDegree;
  town.touch("yes");
  CHECK(town.mission.state() == State::seek);  // nobody was asked anything
  town.touch("left");
  CHECK(town.mission.state() == State::confirm);
  CHECK(town.told() == "stop");
  CHECK(town.said() == "Do I go to the left?");
  town.step();
  CHECK(town.said() == "");
  town.touch("no");
  CHECK(town.mission.state() == State::read);
  CHECK(town.said() == "Which way, then?");
  town.touch("right"), town.touch("ahead");
  CHECK(town.said() == "Do I go straight on?");
  town.touch("left"), town.touch("yes");
  CHECK(town.said() == "Thank you. I go to the left.");
  REQUIRE(town.mission.direction_rad().has_value());
  CHECK(*town.mission.direction_rad() == doctest::Approx(0).epsilon(1e-9));
  CHECK(town.told() == "rotate 1.571");
  town.touch("right");
  CHECK(town.mission.state() == State::turn);  // it has its way
  town.obey(), town.step();
  CHECK(town.mission.state() == State::drive);
}

TEST_CASE("a direction that nobody confirms is none; each one is understood while a pedestrian is asked, too") {
  Town town;
  town.touch("ahead");
  town.step(14.7);
  CHECK(town.mission.state() == State::confirm);
  town.step(0.3);
  CHECK(town.mission.state() == State::seek);
  CHECK_FALSE(town.mission.direction_rad().has_value());
  town.percept.pedestrian = "anna";
  town.step();
  REQUIRE(town.mission.state() == State::ask);
  for (const auto& [answer, rad] : {std::pair{"left", 90 * kDegree}, {"ahead", 0.0}, {"right", -90 * kDegree}}) {
    Town asked = town;
    asked.touch(answer), asked.touch("yes");
    CHECK(asked.mission.state() == State::turn);
    CHECK(*asked.mission.direction_rad() == doctest::Approx(rad));
  }
}

TEST_CASE("stop on the screen ends the mission wherever it is, and a direction takes it up again") {
  for (int steps = 0; steps < 4; ++steps) {
    Town town;
    if (steps > 0) town.ask_the_way(0), town.obey(), town.step();
    if (steps > 1) town.see_sign(2), town.step(), town.obey(), town.step();
    if (steps > 2) town.percept.leader = false, town.step(5);
    town.touch("stop");
    CHECK(town.mission.state() == State::failed);
    CHECK(town.told() == "stop");
    CHECK(town.mission.trouble() == "told to stop at the screen");
    CHECK(town.said() == "I cannot go on: told to stop at the screen");
    const uint32_t number = town.mission.task().number;
    town.touch("stop");
    CHECK(town.mission.task().number == number);
    town.touch("ahead");
    CHECK(town.mission.state() == State::confirm);
    CHECK(town.mission.trouble().empty());
  }
}

TEST_CASE("while it is led, no direction is taken from the screen") {
  Town town;
  town.ask_the_way(0);
  town.obey(), town.step();
  town.see_sign(2), town.step();
  CHECK(town.said() == "Please lead me across. I follow a chessboard shirt.");
  town.touch("left");
  CHECK(town.mission.state() == State::face);
  town.obey(), town.step();
  town.touch("left");
  CHECK(town.mission.state() == State::follow);
}

TEST_CASE("where no free ground leads on the mission fails; nobody leads across: too") {
  Town closed;
  closed.ground.fill(1, -10, 2, 10, 1000);
  closed.ask_the_way(0);
  closed.obey(), closed.step();
  REQUIRE(closed.mission.state() == State::drive);
  const uint32_t number = closed.mission.task().number;
  closed.step(29), closed.step(0.9);
  CHECK(closed.mission.task().number == number);
  closed.step();
  CHECK(closed.mission.trouble() == "no free ground leads on");

  Town lonely;
  lonely.ask_the_way(0);
  lonely.obey(), lonely.step();
  lonely.see_sign(2), lonely.step();
  lonely.obey(), lonely.step();
  REQUIRE(lonely.mission.state() == State::follow);
  lonely.step(119);
  CHECK(lonely.mission.state() == State::follow);
  lonely.step(2);
  CHECK(lonely.mission.trouble() == "nobody leads across");
}

TEST_CASE("whoever leads across is looked for beside the robot, while he is not in sight") {
  Town town;
  town.ask_the_way(0);
  town.obey(), town.step();
  town.see_sign(2), town.step();
  town.obey(), town.step();
  REQUIRE(town.mission.state() == State::follow);
  town.step(3), town.step(3);
  CHECK(town.mission.state() == State::follow);  // he is there
  town.percept.leader = false;
  town.step(3.9);
  CHECK(town.mission.state() == State::follow);
  const PlanarPose began = town.percept.robot;
  for (const char* look :
       {"rotate 0.700", "rotate -1.400", "rotate 2.100", "rotate -2.800", "rotate 1.400", "rotate 0.700"}) {
    town.step(0.2);
    CHECK(town.mission.state() == State::face);
    CHECK(town.told() == look);
    town.obey(), town.step();
    CHECK(town.mission.state() == State::follow);
    town.step(4);
  }
  town.percept.speed_m_s = 0.6;  // under way person_tracking itself looks where he went
  town.step(20);
  CHECK(town.mission.state() == State::follow);
  town.percept.robot = compose(began, {5.2, 0, 0});  // the looks did not begin the way anew
  town.percept.speed_m_s = 0, town.step();
  town.step(3.1);
  CHECK(town.mission.crossed() == 1);
}

TEST_CASE("steps of a mission allocate nothing") {
  Town town;
  const uint64_t before = thread_memory_use().allocations;
  town.percept.pedestrian = "anna";
  for (int i = 0; i < 2; ++i) town.step(), town.ended = town.mission.task().number, town.step();
  for (int i = 0; i < 8; ++i) town.percept.pointed_rad = 0, town.step();
  town.ended = town.mission.task().number, town.step(), town.step();
  CHECK(town.mission.state() == State::drive);
  town.touch("stop"), town.touch("left"), town.touch("yes");
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
}

TEST_CASE("the next place is free and known, along the direction, and off what is occupied") {
  WayAhead ways(Ground::kAll, {});
  std::mt19937 random(1);
  int found = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Ground ground;
    const auto draw = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
    for (int i = 0; i < 4; ++i) {
      const double x = draw(-6, 6), y = draw(-6, 6);
      if (std::hypot(x, y) > 2) ground.fill(x, y, x + draw(0.3, 2), y + draw(0.3, 2), i == 0 ? -1 : 1000);
    }
    const double direction = draw(-3, 3);
    const auto place = ways.next(ground.view(), {0, 0}, direction);
    if (!place) continue;
    ++found;
    const double along = place->x_m * std::cos(direction) + place->y_m * std::sin(direction);
    const double aside = place->y_m * std::cos(direction) - place->x_m * std::sin(direction);
    CHECK(along >= 1 - 1e-9);
    CHECK(along <= 3.5 + 1e-9);
    CHECK(std::abs(aside) <= std::min(along, 2.0) + 1e-9);
    const auto view = ground.view();
    const auto cell = view.cell_of(place->x_m, place->y_m);
    CHECK(view.cells.at(cell.column, cell.row) == 0);
    for (int row = 0; row < Ground::kCells; ++row)
      for (int column = 0; column < Ground::kCells; ++column)
        if (view.cells.at(column, row) > 500)
          CHECK(std::hypot(view.middle_x_m({column, row}) - view.middle_x_m(cell),
                           view.middle_y_m({column, row}) - view.middle_y_m(cell)) > 0.75 - 1e-9);
  }
  CHECK(found > 150);
  Ground unknown;
  unknown.fill(-10, -10, 10, 10, -1);
  CHECK_FALSE(ways.next(unknown.view(), {0, 0}, 0).has_value());
}

TEST_CASE("a kerb beside the way pushes the place aside, and one across it ends the way") {
  WayAhead ways(Ground::kAll, {});
  Ground ground;
  ground.fill(-10, 0.5, 10, 10, 1000);
  const auto beside = ways.next(ground.view(), {0, -0.5}, 20 * kDegree);
  REQUIRE(beside.has_value());
  CHECK(beside->y_m <= 0.5 - 0.75 + 0.25);
  CHECK(beside->x_m > 2);
  ground.fill(1.2, -10, 3, 10, 1000);
  CHECK_FALSE(ways.next(ground.view(), {0, -1}, 0).has_value());
}

TEST_CASE("the middle direction is the one with the least sum of angles, over the turn as well") {
  const std::array spread{3.1, -3.1, -3.0, 0.5};
  CHECK(middle_direction(spread) == doctest::Approx(-3.1));
  const std::array alone{1.0};
  CHECK(middle_direction(alone) == 1.0);
}

TEST_CASE("where a body points: of whoever was asked, along the arm that is nearest to level") {
  test::Box<BodyPoses> bodies({0, 0, 1, 4});
  const auto add = [&](float x, float y, PointingRay one, PointingRay other) {
    Body body{};
    body.joints[0] = {x, y, 1.6f, 1};
    body.pointing[0] = one, body.pointing[1] = other;
    bodies->bodies.push_back(body);
  };
  const PointingRay down{0, 0, 1.4f, 0, 0.1f, -0.995f}, right{0, 0, 1.4f, 1, 0, 0}, left{0, 0, 1.4f, -0.995f, 0, -0.1f};
  const PointingRay none{};
  CHECK_FALSE(pointed_direction(*bodies, 0, 2).has_value());
  add(2, 2, right, none);
  CHECK_FALSE(pointed_direction(*bodies, 0, 2).has_value());  // somebody else
  add(0.2f, 2.1f, down, left);
  REQUIRE(pointed_direction(*bodies, 0, 2).has_value());
  CHECK(*pointed_direction(*bodies, 0, 2) == doctest::Approx(90 * kDegree));
  CHECK(*pointed_direction(*bodies, 2, 2) == doctest::Approx(-90 * kDegree));
  add(-2, 2, down, none);
  CHECK_FALSE(pointed_direction(*bodies, -2, 2).has_value());
}
