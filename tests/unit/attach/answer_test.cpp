// SPDX-License-Identifier: Apache-2.0
// The question `answer` over the socket: what a job of the device takes, and what is refused.
#include <doctest/doctest.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>

#include "graph/ace/ace_registry.hpp"
#include "graph/attach/endpoint.hpp"
#include "graph/attach/server.hpp"
#include "hal/interaction/console.hpp"
#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/web.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/testing.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace takt;
using test::has;
using Json = nlohmann::ordered_json;

/// A run with a screen and a terminal.
struct Screens {
  test::TemporaryFolder folder{"/tmp"};
  Registry registry = ace_registry();
  InteractionNode screen{std::make_unique<WebScreen>()},
      terminal{std::make_unique<Console>("terminal", ConsoleSettings{"/dev/null", "/dev/null"})};
  graph::GraphSpec spec;
  Plan plan;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Transport> transport = make_local_transport(plan.ports);
  std::unique_ptr<attach::Server> server;

  Screens() {
    setenv("XDG_RUNTIME_DIR", folder.path.c_str(), 1);
    add("screen", "web", screen);
    add("terminal", "console", terminal);
    board = std::make_unique<RunBoard>(plan);
    server = std::make_unique<attach::Server>(attach::Subject{registry, spec, plan, *board, *transport});
  }
  void add(const char* id, const char* driver, InteractionNode& node) {
    graph::DeviceSpec device;
    device.id = id, device.kind = "interaction", device.driver = driver;
    spec.devices.push_back(device);
    TaskPlan task;
    task.name = id, task.node = &node, task.device = true, task.source.answers = node.takes_answers();
    plan.tasks.push_back(task);
    test::set_up(node);
    node.start(0);
  }
  /// `job`: the node takes what is posted meanwhile, as between two of its jobs.
  Json ask(const Json& question, bool job = false) {
    auto connection = attach::connect_to(getpid());
    REQUIRE(connection);
    REQUIRE(connection->write(question));
    if (ParamMail& mail = board->mail(0); job) {
      while (mail.state.load() != ParamMail::posted) sched_yield();
      if (deliver(mail, screen)) {
        keep(board->kept(0, mail.param), mail, 0);
        mail.state.store(ParamMail::taken);
      }
    }
    return connection->read_line().value_or(Json());
  }
  Json answer(const char* device, const std::string& text, bool job = false) {
    return ask({{"do", "answer"}, {"device", device}, {"text", text}}, job);
  }
  std::string task() {
    const auto reading = static_cast<Interaction&>(screen.device()).read(1);
    return std::to_string(reading.number) + " " + std::string(reading.task);
  }
};

}  // namespace

TEST_CASE("answer: taken by the device between two jobs, shown as a parameter with who gave it") {
  Screens scene;
  CHECK(scene.answer("screen", "grüß Gott", true) == Json{{"ok", true}});
  CHECK(scene.task() == "1 grüß Gott");
  const std::string longest(127, 'x');
  CHECK(scene.answer("screen", longest, true) == Json{{"ok", true}});
  CHECK(scene.task() == "2 " + longest);
  const Json told = scene.ask({{"do", "get"}, {"param", "screen.answer"}})["parameters"][0];
  CHECK(told["value"] == longest);
  CHECK(told["from"] == "set");
  CHECK(told["by_user"] == getuid());
  const Json other = scene.ask({{"do", "get"}, {"param", "terminal.answer"}})["parameters"][0];
  CHECK(other["value"] == "");
  CHECK(other["from"] == "default");
  CHECK(scene.ask({{"do", "get"}, {"param", "terminal.fault"}})["parameters"][0]["value"] == "none");
}

TEST_CASE("answer: one that comes before the device has read the last is refused and does not replace it") {
  Screens scene;
  CHECK(scene.answer("screen", "left", true) == Json{{"ok", true}});
  CHECK(has(scene.answer("screen", "right", true).value("error", ""),
            "parameter `answer` of screen waits: the answer before it has not been read yet"));
  CHECK(scene.task() == "1 left");
  CHECK(scene.answer("screen", "right", true) == Json{{"ok", true}});
  CHECK(scene.task() == "2 right");
}

TEST_CASE("answer: what is refused names the device, its driver and the valid ones, and nothing is posted") {
  Screens scene;
  const auto error = [&](const char* device, const std::string& text) {
    return scene.answer(device, text).value("error", "");
  };
  CHECK(has(error("scren", "yes"), "there is no device `scren`; did you mean `screen`?"));
  CHECK(has(error("terminal", "yes"),
            "device terminal (kind interaction, driver console) takes no answers: only those with the driver web do"));
  CHECK(has(error("terminal", "yes"), "screen"));
  CHECK(has(error("screen", ""), "an answer to device screen needs words"));
  CHECK(has(error("screen", std::string(128, 'x')), "at most 127 bytes; this one to device screen has 128"));
  CHECK(has(error("screen", "yes\nstop"), "one line of text"));
  CHECK(has(scene.ask({{"do", "answer"}, {"device", 5}, {"text", "yes"}}).value("error", ""), "cannot be answered"));
  CHECK(scene.board->mail(0).state.load() == ParamMail::empty);
  CHECK(scene.board->mail(1).state.load() == ParamMail::empty);
  CHECK(scene.task() == "0 ");
}
