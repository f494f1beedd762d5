// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <fstream>

#include "hal/interaction/console.hpp"
#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/script.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/interaction/fifo.hpp"

using namespace takt;
using test::Fifo;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("scripts and their mistakes") {
  const auto script = parse_task_script(" 2s goal cup_1.level=full; 500 ms  stop");
  REQUIRE_FALSE(script);
  const auto right = parse_task_script("500ms explore;; 2s goal cup_1.level=full ;");
  REQUIRE(right);
  REQUIRE(right->size() == 2);
  CHECK((*right)[0].after_ns == kSecond / 2);
  CHECK((*right)[1].task == "goal cup_1.level=full");
  CHECK(parse_task_script("")->empty());
  CHECK(parse_task_script("soon stop").error().find("`soon stop` does not begin with a time") == 0);
  CHECK(parse_task_script("2s").error().find("`2s` has no task") == 0);
  CHECK(parse_task_script("2s a; 1s b").error().find("`1s b` comes before") == 0);
  CHECK(parse_task_script("1s " + std::string(241, 'x')).error().find("longer") != std::string::npos);
}

TEST_CASE("lines in pieces, comments, several at once, lines that are too long") {
  const Fifo fifo;
  Console console("person", {fifo.in, fifo.out});
  REQUIRE(console.open());
  REQUIRE(console.start(0));
  fifo.write("goal cup_1.le");
  CHECK(console.read(1).number == 0);
  fifo.write("vel=full\n\n  # nothing\nstop # now\r\n");
  CHECK(console.read(2).task == "goal cup_1.level=full");
  const InteractionReading second = console.read(3);
  CHECK(second.task == "stop");
  CHECK(second.number == 2);
  CHECK(console.read(4).number == 2);
  fifo.write(std::string(241, 'x') + "\n" + std::string(3000, 'y') + "\nexplore\n");
  InteractionReading last;
  for (int i = 0; i < 8; ++i) last = console.read(5 + i);
  CHECK(last.number == 3);
  CHECK(last.task == "explore");
  CHECK(console.say("I cannot\nstop"));
  CHECK(contents(fifo.out) ==
        "a task has 240 characters at most; this one is not taken\n"
        "a task has 240 characters at most; this one is not taken\nI cannot\nstop\n");
}

TEST_CASE("a file is read to its end, which is no loss; what does not exist is told") {
  const test::TemporaryFolder folder;
  const auto file = folder.write("tasks", "tell cup_1.level=empty\nexplore\n");
  Console console("person", {file, (folder.path / "out").string()});
  REQUIRE(console.open());
  REQUIRE(console.start(0));
  CHECK(console.read(1).task == "tell cup_1.level=empty");
  CHECK(console.read(2).task == "explore");
  for (int i = 3; i < 6; ++i) CHECK(console.read(i).status == ReadStatus::ok);
  Console none("person", {"/nowhere/at/all", "/dev/null"});
  const auto opened = none.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().text().find("person: /nowhere/at/all") == 0);
}

TEST_CASE("the node repeats the newest task, says what is new, and goes on counting after a restart") {
  const Fifo fifo;
  const auto make = [&] {
    return std::make_unique<InteractionNode>(std::make_unique<Console>("person", ConsoleSettings{fifo.in, fifo.out}));
  };
  auto node = make();
  test::set_up(*node);
  test::BoxWriter<RobotTask> task(*node->outputs()[0]);
  node->start(0);
  fifo.write("explore\n");
  test::Box<TextStatus> speech(Capacity{0, 0, 1, 20});
  for (const char c : std::string("hello")) speech->text.push_back(c);
  test::latch(test::input(*node, "speech"), speech, 0, 1);
  for (int i = 0; i < 3; ++i) {
    task.clear();
    CHECK(test::run(*node));
    CHECK(task.message().number == 1);
    CHECK(std::string(task.message().text.data(), task.message().text.size) == "explore");
    test::latch(test::input(*node, "speech"), speech, 0, 1);
    PortAccess::set_held(test::input(*node, "speech"), 1, false, 1);
  }
  CHECK(contents(fifo.out) == "hello\n");
  node->finish();
  auto again = make();
  test::set_up(*again);
  PortAccess::hand_over(*again->outputs()[0], &task.message());
  test::BoxWriter<RobotTask> later(*again->outputs()[0]);
  again->start(0);
  fifo.write("stop\n");
  CHECK(test::run(*again));
  CHECK(later.message().number == 2);
}
