// SPDX-License-Identifier: Apache-2.0
// What was set while a graph runs outlives the process of the node: the same board and transport, another node and
// task.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "rt/msg/odometry.hpp"
#include "rt/msg/requests.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/sched/task.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::kMs;

struct Settable final : Node {
  Param<double> gain{this, "gain", 1.0, {0.0, 10.0}, "1", "read in each job"};
  Param<int> size{this, "size", 3, {1, 9}, "", "read in setup"};
  Param<std::string> words{this, "words", "none", "", "read in each job"};
  Output<Odometry> out{this, "out", "test data"};
  double gain_at_start = 0;
  std::string words_at_start;
  int jobs = 0;
  Settable() {
    accept_requests();
    static_cast<void>(size());
    end_setup();
  }
  void setup(Setup&) override {}
  void start(int64_t) override {
    gain_at_start = gain;
    words_at_start = words;
  }
  void run(Job&) override { ++jobs; }
};

struct Asker final : Node {
  Output<Requests> requests{this, "requests", "test data"};
  void setup(Setup&) override {}
  void run(Job& job) override {
    Requests* message = requests.loan();
    REQUIRE(message != nullptr);
    Request stop;
    stop.run = 0;
    std::strncpy(stop.node, "node", sizeof stop.node - 1);
    message->wanted.push_back(stop);
    requests.send(job.release_ns());
  }
};

/// One process of a run after the other: board and transport stay.
struct Processes {
  VirtualClock clock{1000 * kMs};
  Asker asker;
  std::unique_ptr<Settable> node = std::make_unique<Settable>();
  Plan plan;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Task> task;
  uint64_t job = 0;

  Processes() {
    test::add_task(plan, asker, "asker", 0, {0, 0, 1, 4});
    test::add_task(plan, *node, "node", 0);
    plan.tasks[1].edges.push_back({node->inputs().size() - 1, 0, 1, 0});
    plan.ports[0].held = 1;
    plan.modes = {{"full", {1, 1}}, {"less", {1, 0}}};
    plan.mode = "full";
    board = std::make_unique<RunBoard>(plan);
    transport = make_local_transport(plan.ports);
    start(false);
  }
  void start(bool again) {
    task = std::make_unique<Task>(plan, 1, *transport, clock, *board);
    task->start(1000 * kMs, again ? transport.get() : nullptr);
  }
  void restart() {
    task.reset();
    node = std::make_unique<Settable>();
    plan.tasks[1].node = node.get();
    start(true);
  }
  void run_job() {
    task->run(job, (1000 + 100 * static_cast<int64_t>(job)) * kMs);
    task->count(0);
    ++job;
  }
  void set(size_t param, const ParamValue& value) {
    REQUIRE(post(board->mail(1), param, value, 1000));
    run_job();
  }
};

}  // namespace

TEST_CASE("a restarted node has the values that it was given, before it starts") {
  Processes processes;
  processes.set(0, 2.5);
  processes.set(2, std::string("a text of more than sixteen"));
  processes.set(0, 3.5);
  CHECK(processes.board->mail(1).state.load() == ParamMail::taken);
  processes.restart();
  CHECK(processes.node->gain_at_start == 3.5);
  CHECK(processes.node->words_at_start == "a text of more than sixteen");
  CHECK(processes.node->size() == 3);
  const KeptParam& kept = processes.board->kept(1, 0);
  CHECK(kept.count.load() == 2);
  CHECK(kept.taken_up.load() == 1);
  CHECK(kept.newest()->by_user == 1000);
  CHECK(kept.newest()->at_ns == 1000 * kMs);
  CHECK(processes.board->kept(1, 1).newest() == nullptr);
  processes.restart();
  CHECK(processes.node->gain_at_start == 3.5);
  CHECK(kept.taken_up.load() == 2);
}

TEST_CASE("a value that the node refuses is not kept") {
  Processes processes;
  processes.set(0, 99.0);
  CHECK(processes.board->mail(1).state.load() == ParamMail::refused);
  processes.set(1, int64_t{4});
  CHECK(processes.board->mail(1).state.load() == ParamMail::refused);
  for (size_t p = 0; p < 3; ++p) CHECK(processes.board->kept(1, p).newest() == nullptr);
  processes.restart();
  CHECK(processes.node->gain_at_start == 1.0);
}

TEST_CASE("a process that is killed at any step of taking a value leaves the one before or the new one") {
  Processes processes;
  processes.set(0, 2.5);
  REQUIRE(post(processes.board->mail(1), 0, 7.5));
  KeptParam& kept = processes.board->kept(1, 0);
  SUBCASE("before the node looked") {}
  SUBCASE("after the node accepted it") { CHECK(deliver(processes.board->mail(1), *processes.node)); }
  SUBCASE("while it was written down") { kept.places[(kept.count.load() + 1) % 2].real = 4e300; }
  processes.restart();
  CHECK(processes.node->gain_at_start == 2.5);
  processes.run_job();
  CHECK(processes.node->gain() == 7.5);
  CHECK(processes.board->mail(1).state.load() == ParamMail::taken);
  CHECK(kept.newest()->real == 7.5);
}

TEST_CASE("a value written down, with the mail still there, is taken again and is the same") {
  Processes processes;
  REQUIRE(post(processes.board->mail(1), 0, 7.5));
  REQUIRE(deliver(processes.board->mail(1), *processes.node));
  keep(processes.board->kept(1, 0), processes.board->mail(1), 5);
  processes.restart();
  CHECK(processes.node->gain_at_start == 7.5);
  processes.run_job();
  CHECK(processes.node->gain() == 7.5);
  CHECK(processes.board->mail(1).state.load() == ParamMail::taken);
}

TEST_CASE("a restart keeps the mode and the requests, and tells that the quality level is the first again") {
  Processes processes;
  SUBCASE("mode") {
    processes.board->modes().request(1, 0, "test");
    processes.restart();
    processes.run_job();
    CHECK(processes.node->jobs == 0);
  }
  SUBCASE("request to stop") {
    Task asker(processes.plan, 0, *processes.transport, processes.clock, *processes.board);
    asker.run(0, 1000 * kMs);
    processes.clock.advance_to(1050 * kMs);
    processes.job = 1;
    processes.restart();
    processes.run_job();
    CHECK(processes.node->jobs == 0);
    CHECK(processes.board->task(1).paused.load() == 1);
  }
  SUBCASE("level") {
    processes.board->task(1).last_level.store(1);  // as the process before had it
    processes.restart();
    processes.run_job();
    CHECK(processes.board->task(1).level_changes.load() == 1);
    CHECK(processes.board->task(1).changes[0].level == 0);
  }
}
