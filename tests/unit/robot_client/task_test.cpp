// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/task.hpp"

#include <doctest/doctest.h>

#include <numbers>

using namespace takt::robot_client;

TEST_CASE("tasks in words") {
  const auto goal = parse_task("  goal cup_1.level=full, bottle_1.closed=true ");
  REQUIRE(goal);
  CHECK(goal->verb == Verb::goal);
  REQUIRE(goal->facts.size() == 2);
  CHECK(goal->facts[0].object == "cup_1");
  CHECK(goal->facts[0].attribute == "level");
  CHECK(goal->facts[0].value == "full");
  CHECK(goal->facts[1].value == "true");
  const auto deed = parse_task("do fill cup_1 bottle_2");
  REQUIRE(deed);
  CHECK(deed->words == std::vector<std::string>{"fill", "cup_1", "bottle_2"});
  const auto drive = parse_task("drive 3 -1.5m");
  REQUIRE(drive);
  CHECK(drive->x_m == 3);
  CHECK(drive->y_m == -1.5);
  CHECK(parse_task("rotate -90deg")->amount == doctest::Approx(-std::numbers::pi / 2));
  CHECK(parse_task("rotate 1.5")->amount == 1.5);
  CHECK(parse_task("ahead 0.5m")->amount == 0.5);
  CHECK(parse_task("explore")->verb == Verb::explore);
  CHECK(parse_task("stop")->verb == Verb::stop);
  CHECK(parse_task("tell cup_1.level=empty")->verb == Verb::tell);
  const auto add = parse_task("add cup cup_3 1.5 -2m");
  REQUIRE(add);
  CHECK(add->words == std::vector<std::string>{"cup", "cup_3"});
  CHECK(add->x_m == 1.5);
  CHECK(add->y_m == -2);
  const auto move = parse_task("move cup_3 0 4");
  REQUIRE(move);
  CHECK(move->words == std::vector<std::string>{"cup_3"});
  CHECK(move->y_m == 4);
  CHECK(parse_task("remove cup_3")->words == std::vector<std::string>{"cup_3"});
}

TEST_CASE("what is no task is quoted, with what is valid") {
  struct Wrong {
    const char *text, *valid;
  };
  for (const Wrong& w : {Wrong{"", "goal, do, drive"},
                         {"fly 3", "goal, do, drive, rotate, ahead, explore, tell, add, move, remove or stop"},
                         {"goal", "goal OBJECT.ATTRIBUTE=VALUE"},
                         {"goal cup_1", "OBJECT.ATTRIBUTE=VALUE"},
                         {"goal cup_1.=full", "OBJECT.ATTRIBUTE=VALUE"},
                         {"goal .level=full", "OBJECT.ATTRIBUTE=VALUE"},
                         {"tell cup_1.level=", "tell OBJECT.ATTRIBUTE=VALUE"},
                         {"do fill", "do ACTION OBJECT"},
                         {"do a b c d e f", "do ACTION OBJECT"},
                         {"drive 3", "drive X Y"},
                         {"drive 3 nan", "drive X Y"},
                         {"drive 3 1e9", "drive X Y"},
                         {"rotate 90m", "rotate ANGLE"},
                         {"ahead 1deg", "ahead DISTANCE"},
                         {"add cup 1 2", "add TYPE OBJECT X Y"},
                         {"add cup cup_3 1 east", "add TYPE OBJECT X Y"},
                         {"move cup_3 1", "move OBJECT X Y"},
                         {"remove cup 3", "remove OBJECT"},
                         {"stop now", "stop alone"}}) {
    CAPTURE(w.text);
    const auto task = parse_task(w.text);
    REQUIRE_FALSE(task);
    CHECK(task.error().find(std::string("\"") + w.text + "\"") == 0);
    CHECK(task.error().find(w.valid) != std::string::npos);
  }
}

TEST_CASE("only tasks that name an end are taken up again after a restart") {
  CHECK(names_an_end(Verb::goal));
  CHECK(names_an_end(Verb::drive));
  CHECK(names_an_end(Verb::explore));
  CHECK_FALSE(names_an_end(Verb::rotate));
  CHECK_FALSE(names_an_end(Verb::ahead));
  CHECK_FALSE(names_an_end(Verb::act));
}
