// SPDX-License-Identifier: Apache-2.0
// Tasks and questions of people for the robot of a run.
#include "graph/robot/robot_questions.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace takt;
using robot::Json;

namespace {

/// As echo gives two texts of 32 characters.
Json names(const std::string& first, const std::string& second) {
  Json numbers = Json::array();
  for (const std::string& text : {first, second})
    for (size_t i = 0; i < 32; ++i) numbers.push_back(i < text.size() ? static_cast<int>(text[i]) : 0);
  return numbers;
}

Json list(const std::vector<Json>& items) { return {{"size", items.size()}, {"first", items}}; }

const Json kMap{{"port", "mind.map"},
                {"message",
                 {{"names", list({names("table_1", "table"), names("cup_1", "cup")})},
                  {"places", list({Json{1, 2, 0, 0, 1, 0}, Json{0.55, 2.25, 0.8, 0, 1, 2}})},
                  {"attributes", list({names("level", "full"), names("colour", "red")})}}}};

struct Robots {
  std::vector<std::string> clients{"mind"};
  std::vector<Json> asked;
  Json run_says = kMap;
  robot::RobotQuestions questions{[this] {
                                    Json nodes{{{"name", "eye"}, {"type", "stereo"}}};
                                    for (const std::string& name : clients)
                                      nodes.push_back({{"name", name}, {"type", "robot_client"}});
                                    return Json{{"nodes", nodes}};
                                  },
                                  [this](const Json& question) {
                                    asked.push_back(question);
                                    return run_says;
                                  }};
  std::string error(const Json& question) { return questions.answer(question).value("error", ""); }
};

}  // namespace

TEST_CASE("A task is set on the client, twice with the same words as two tasks") {
  Robots robots;
  robots.run_says = {{"ok", true}};
  CHECK(robot::RobotQuestions::is_asked({{"do", "task"}}));
  CHECK(!robot::RobotQuestions::is_asked({{"do", "set"}}));
  CHECK(robots.questions.answer({{"do", "task"}, {"words", "goal cup_1.level=full"}}) == robots.run_says);
  REQUIRE(robots.asked.size() == 1);
  CHECK(robots.asked[0]["do"] == "set");
  CHECK(robots.asked[0]["param"] == "mind.task");
  const auto value = robots.asked[0]["value"].get<std::string>();
  CHECK(value.ends_with(" goal cup_1.level=full"));
  CHECK(value.front() >= '0');
  CHECK(value.front() <= '9');
}

TEST_CASE("What is no task, and what no robot could take, is refused before the run is asked") {
  Robots robots;
  CHECK(robots.error({{"do", "task"}, {"words", "dance"}}).find("dance") != std::string::npos);
  CHECK(robots.error({{"do", "task"}, {"words", ""}}) != "");
  CHECK(robots.error({{"do", "task"}, {"words", 7}}) != "");
  CHECK(robots.error({{"do", "task"}, {"words", "stop"}, {"client", "eye"}}) == "`client` must be one of: mind");
  robots.clients = {"mind", "soul"};
  CHECK(robots.error({{"do", "task"}, {"words", "stop"}}) == "`client` must be one of: mind, soul");
  CHECK(robots.asked.empty());
  robots.questions.answer({{"do", "task"}, {"words", "stop"}, {"client", "soul"}});
  CHECK(robots.asked.at(0)["param"] == "soul.task");
  robots.clients = {};
  CHECK(robots.error({{"do", "know"}, {"object", "cup_1"}}) == "the run has no node of type robot_client");
}

TEST_CASE("What the robot knows of an object, of a state, and of what it does not know") {
  Robots robots;
  const auto know = [&](const char* object) { return robots.questions.answer({{"do", "know"}, {"object", object}}); };
  CHECK(know("cup_1") == Json{{"ok", true}, {"text", "cup_1 is a cup at 0.55 m, 2.25 m; level=full colour=red"}});
  CHECK(know("cup_1.colour")["text"] == "red");
  CHECK(know("table_1")["text"] == "table_1 is a table at 1.00 m, 2.00 m; no state is known");
  CHECK(know("cup_1.size")["error"] == "of cup_1 the robot knows level=full colour=red");
  CHECK(know("cup_2")["error"] == "the robot knows no object cup_2; it knows: table_1, cup_1");
  CHECK(robots.asked.at(0)["port"] == "mind.map");
  robots.run_says = {{"error", "nothing was published yet"}};
  CHECK(know("cup_1")["error"] == "nothing was published yet");
}
