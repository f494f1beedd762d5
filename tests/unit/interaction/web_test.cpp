// SPDX-License-Identifier: Apache-2.0
// Answers on the robot's screen: on their way to a task, once each, also over a restart of the process.
#include "hal/interaction/web.hpp"

#include <doctest/doctest.h>

#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/script.hpp"
#include "hal/interaction/web_double.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

using namespace takt;

namespace {

/// One process of a run after the other: what was kept and what was sent stays.
struct Process {
  std::unique_ptr<InteractionNode> node = std::make_unique<InteractionNode>(std::make_unique<WebScreen>());
  std::unique_ptr<test::BoxWriter<RobotTask>> sent;

  /// `kept`: the newest answer that the process before was given; `last`: its newest message.
  void start(const char* kept = nullptr, const RobotTask* last = nullptr) {
    test::set_up(*node);
    node->end_setup();
    if (kept != nullptr) REQUIRE(param().set(std::string(kept)));
    if (last != nullptr) PortAccess::hand_over(*node->outputs()[0], last);
    sent = std::make_unique<test::BoxWriter<RobotTask>>(*node->outputs()[0]);
    node->start(0);
    PortAccess::hand_over(*node->outputs()[0], nullptr);
  }
  ParamBase& param() {
    for (ParamBase* param : node->params())
      if (param->name() == DeviceNode::kAnswer) return *param;
    FAIL("no parameter for answers");
    return *node->params()[0];
  }
  tl::expected<void, std::string> answer(const char* words) { return param().set(std::string(words)); }
  /// "2 stop": number and words of the task that the next job sends.
  std::string job() {
    sent->clear();
    REQUIRE(test::run(*node));
    const RobotTask& task = sent->message();
    return std::to_string(task.number) + " " + std::string(task.text.data(), task.text.size);
  }
};

}  // namespace

TEST_CASE("an answer is the next task, once, and is repeated with every job") {
  Process process;
  process.start();
  CHECK(process.param().live());
  CHECK(process.job() == "0 ");
  REQUIRE(process.answer("explore"));
  const auto early = process.answer("stop");
  REQUIRE_FALSE(early);
  CHECK(early.error() == "waits: the answer before it has not been read yet");
  CHECK(process.param().value_text() == "explore");
  CHECK(process.job() == "1 explore");
  CHECK(process.job() == "1 explore");
  REQUIRE(process.answer("explore"));
  CHECK(process.job() == "2 explore");
  CHECK_FALSE(process.answer(""));
  CHECK_FALSE(process.param().set(int64_t{3}));
  CHECK(process.job() == "2 explore");
}

TEST_CASE("a restarted process gives no answer twice, and loses none that nobody has seen") {
  Process before;
  before.start();
  REQUIRE(before.answer("explore"));
  CHECK(before.job() == "1 explore");

  Process again;
  again.start("explore", &before.sent->message());
  CHECK(again.job() == "1 explore");
  REQUIRE(again.answer("stop"));
  CHECK(again.job() == "2 stop");

  Process died_before_it_sent;
  died_before_it_sent.start("stop", &before.sent->message());
  CHECK(died_before_it_sent.job() == "2 stop");

  Process nothing_known;
  nothing_known.start("explore");
  CHECK(nothing_known.job() == "0 ");
}

TEST_CASE("drivers without a screen refuse answers") {
  InteractionNode script(
      std::make_unique<ScriptedPerson>(std::vector<TimedTask>{}, [](int64_t epoch_ns) { return epoch_ns; }));
  InteractionNode shell(nullptr);
  for (InteractionNode* node : {&script, &shell}) {
    CHECK_FALSE(node->takes_answers());
    for (ParamBase* param : node->params())
      if (param->name() == DeviceNode::kAnswer)
        CHECK(param->set(std::string("stop")).error() == "cannot be set: the device has no screen");
  }
}

TEST_CASE("somebody before a double presses what is due, again while nobody takes it, in vain while it is silent") {
  auto line = std::make_shared<AnswerLine>();
  WebDouble fingers({{10, "explore"}, {11, "stop"}, {20, "left"}, {30, "right"}}, line);
  fingers.begin(1000);
  TaskWords words;
  fingers.run_to(1009);
  CHECK_FALSE(line->take(words));
  fingers.run_to(1012);
  fingers.run_to(1013);
  REQUIRE(line->take(words));
  CHECK(words.text() == "explore");
  CHECK_FALSE(line->take(words));
  fingers.run_to(1014);
  REQUIRE(line->take(words));
  CHECK(words.text() == "stop");
  fingers.misbehave(Misbehaviour::silent);
  fingers.run_to(1025);
  CHECK_FALSE(line->take(words));
  fingers.misbehave(Misbehaviour::none);
  fingers.run_to(1040);
  REQUIRE(line->take(words));
  CHECK(words.text() == "right");
}

TEST_CASE("an answer that is longer than a task changes nothing") {
  AnswerLine line;
  CHECK_FALSE(line.put(std::string(Interaction::kLongestTask + 1, 'x')));
  TaskWords words;
  CHECK_FALSE(line.take(words));
  WebScreen screen;
  REQUIRE(screen.open());
  REQUIRE(screen.start(0));
  CHECK_FALSE(screen.answer(std::string(Interaction::kLongestTask + 1, 'x')));
  CHECK(screen.read(1).number == 0);
  CHECK(screen.answer(std::string(Interaction::kLongestTask, 'x')));
  CHECK(screen.read(2).task.size() == Interaction::kLongestTask);
}
