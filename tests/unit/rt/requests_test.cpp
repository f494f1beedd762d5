// SPDX-License-Identifier: Apache-2.0
// Requests to stop and pace nodes, and parameters set between jobs, in virtual time.
#include "rt/msg/requests.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::kMs;

/// Asks for one thing from a job on, until another.
struct Generator final : Node {
  Output<Requests> requests{this, "requests", "test data"};
  struct Wish {
    uint64_t from_job;
    Request request;
  };
  std::vector<Wish> wishes;
  void setup(Setup&) override { requests.reserve({0, 0, 1, 4}); }
  void run(Job& job) override {
    Requests* message = requests.loan();
    REQUIRE(message != nullptr);
    for (const Wish& wish : wishes)
      if (job.index() == wish.from_job) now = wish.request;
    if (now.node[0] != 0) message->wanted.push_back(now);
    requests.send(job.release_ns());
  }
  Request now;
};

struct Worker final : Node {
  Param<double> gain{this, "gain", 1.0, {0.0, 10.0}, "1", "read in each job"};
  Param<int> size{this, "size", 3, {1, 9}, "", "read in setup"};
  Output<Odometry> out{this, "out", "test data"};
  std::vector<int64_t> releases_ms;
  std::vector<double> gains;
  void setup(Setup&) override { static_cast<void>(size()); }
  void run(Job& job) override {
    releases_ms.push_back(job.release_ns() / kMs - 1000);
    gains.push_back(gain);
    if (out.loan() != nullptr) out.send(job.release_ns());
  }
};

Request request(const char* node, uint8_t run, uint8_t every) {
  Request r;
  std::strncpy(r.node, node, sizeof r.node - 1);
  r.run = run;
  r.every = every;
  return r;
}

struct RequestScene {
  Generator generator;
  Worker worker;
  Plan plan;
  VirtualClock clock{1000 * kMs};

  RequestScene() {
    worker.accept_requests();
    test::add_task(plan, generator, "generator", 0, {0, 0, 1, 4});
    test::add_task(plan, worker, "worker", 50 * kMs);
    plan.tasks[1].edges.push_back({worker.inputs().size() - 1, 0, 1, 0});
    plan.ports[0].held = 1;
  }
  RunResult run(int64_t duration_ns) {
    const auto transport = make_local_transport(plan.ports);
    RunBoard board(plan);
    Executor::Options options;
    options.duration_ns = duration_ns;
    options.board = &board;
    Executor executor(plan, *transport, clock, options);
    RunResult result = executor.run();
    paused = board.task(1).paused.load();
    completed = board.task(1).completed.load();
    return result;
  }
  uint64_t paused = 0, completed = 0;
};

}  // namespace

TEST_CASE("a node that is asked to stop runs no job until it is asked to start, and is not released meanwhile") {
  RequestScene scene;
  scene.generator.wishes = {{3, request("worker", 0, 1)}, {6, request("worker", 1, 1)}};
  const RunResult result = scene.run(1000 * kMs);
  CHECK(scene.worker.releases_ms == std::vector<int64_t>{50, 150, 250, 650, 750, 850, 950});
  CHECK(scene.paused == 3);
  CHECK(scene.completed == 7);
  CHECK(result.released[1] == 7);
  CHECK(result.released[0] == 10);
}

TEST_CASE("a node that is paced runs at every n-th of its releases") {
  RequestScene scene;
  scene.generator.wishes = {{0, request("worker", 1, 3)}};
  CHECK(scene.run(1000 * kMs).released[1] == 4);
  CHECK(scene.worker.releases_ms == std::vector<int64_t>{50, 350, 650, 950});
}

TEST_CASE("requests to other nodes, and none at all, leave a node at its full rate") {
  RequestScene scene;
  scene.generator.wishes = {{0, request("worker2", 0, 1)}};
  CHECK(scene.run(1000 * kMs).released[1] == 10);
  CHECK(scene.worker.releases_ms.size() == 10);
}

TEST_CASE("mail sets a parameter between jobs if the node reads it in its jobs only, else says why not") {
  RequestScene scene;
  Setup setup{scene.clock, {}, {}, 0, {}, 0};
  scene.worker.setup(setup);
  scene.worker.end_setup();
  RunBoard board(scene.plan);
  ParamMail& mail = board.mail(1);
  REQUIRE(post(mail, 0, 2.5));
  CHECK_FALSE(post(mail, 0, 3.5));  // the first is still on its way
  CHECK(deliver(mail, scene.worker));
  CHECK(mail.state.load() == ParamMail::posted);  // what must outlive the process is not noted yet
  mail.state.store(ParamMail::taken);
  CHECK(scene.worker.gain() == 2.5);
  REQUIRE(post(mail, 0, 99.0));
  CHECK_FALSE(deliver(mail, scene.worker));
  CHECK(mail.state.load() == ParamMail::refused);
  CHECK(std::string(mail.refusal.text()) == "is 99, must lie in 0..10");
  CHECK(scene.worker.gain() == 2.5);
  REQUIRE(post(mail, 1, int64_t{4}));
  CHECK_FALSE(deliver(mail, scene.worker));
  CHECK(mail.state.load() == ParamMail::refused);
  CHECK(std::string(mail.refusal.text()) ==
        "is fixed while the graph runs (read at start); give it in the graph's file or with --set, and start again");
  CHECK(scene.worker.size() == 3);
}

TEST_CASE("a text longer than the mail holds is not posted") {
  RequestScene scene;
  RunBoard board(scene.plan);
  CHECK(post(board.mail(0), 0, std::string(127, 'x')));
  board.mail(0).state.store(ParamMail::taken);
  CHECK_FALSE(post(board.mail(0), 0, std::string(128, 'x')));
}
