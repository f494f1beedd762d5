// SPDX-License-Identifier: Apache-2.0
// Runs in virtual time take the CPU that the plan gives them: who waits, who is preempted, what is then seen of it.
#include <doctest/doctest.h>

#include <map>

#include "plans.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/shm/local_transport.hpp"
#include "tests/unit/rt/epoch.hpp"

namespace {

using namespace takt;
using test::kEpoch, test::kMs;

/// Notes when its jobs begin; hands on the newest index it has seen.
struct Walker final : Node {
  Input<Odometry> in{this, "in", "", takt::Need::optional};
  Output<Odometry> out{this, "out", ""};
  const VirtualClock* clock = nullptr;
  std::vector<int64_t> starts_ms;
  std::vector<int64_t> seen;
  void setup(Setup&) override {}
  void run(Job& job) override {
    starts_ms.push_back((clock->now_ns() - kEpoch) / kMs);
    seen.push_back(in.empty() ? -1 : static_cast<int64_t>(in[0].x_m));
    Odometry* message = out.loan();
    REQUIRE(message != nullptr);
    message->x_m = static_cast<double>(job.index());
    out.send(job.release_ns());
  }
};

struct VirtualScene {
  Plan plan;
  VirtualClock clock{kEpoch};
  std::map<std::string, Walker> walkers;
  std::unique_ptr<RunBoard> board;

  explicit VirtualScene(Policy policy, std::vector<int> cores = {0}) {
    plan.policy = policy;
    plan.cores = std::move(cores);
  }
  TaskPlan& add(const std::string& name, int64_t offset_ms, int64_t budget_ms, int64_t deadline_ms) {
    Walker& walker = walkers[name];
    walker.clock = &clock;
    test::add_task(plan, walker, name.c_str(), offset_ms * kMs);
    plan.tasks.back().name = name;
    plan.tasks.back().budget_ns = budget_ms * kMs;
    plan.tasks.back().deadline_ns = deadline_ms * kMs;
    return plan.tasks.back();
  }
  void edge(size_t from, size_t to) {
    plan.tasks[to].edges.push_back({0, plan.tasks[from].ports[0], 1, 0});
    plan.ports[plan.tasks[from].ports[0]].held += 1;
    PortAccess::connect(*plan.tasks[to].node->inputs()[0], {});
  }
  void run(int64_t for_ms = 100, const std::function<int64_t(size_t, uint64_t)>& duration_ns = {}) {
    const auto transport = make_local_transport(plan.ports);
    if (!board) board = std::make_unique<RunBoard>(plan);
    Executor::Options options;
    options.duration_ns = for_ms * kMs;
    options.board = board.get();
    options.job_duration_ns = duration_ns;
    Executor(plan, *transport, clock, options).run();
  }
  int64_t finish_ms(size_t task, size_t job = 0) { return (board->task(task).jobs[job].finish_ns - kEpoch) / kMs; }
};

}  // namespace

TEST_CASE("the age of a message is that at which others may see it") {
  for (const auto& [publish, age_ms] : {std::pair{PublishAt::asap, 5}, {PublishAt::let, 60}}) {
    VirtualScene scene(Policy::fixed);
    scene.add("node", 0, 5, 60).publish = publish;
    scene.run();
    CHECK(scene.board->port(0).age.max_ns() == age_ms * kMs);
  }
}

TEST_CASE("fixed: the shorter deadline preempts, and the longer job ends that much later") {
  VirtualScene scene(Policy::fixed);
  scene.add("slow", 0, 10, 60);
  scene.add("quick", 4, 3, 20);
  scene.run();
  CHECK(scene.walkers["slow"].starts_ms == std::vector<int64_t>{0});
  CHECK(scene.walkers["quick"].starts_ms == std::vector<int64_t>{4});
  CHECK(scene.finish_ms(0) == 13);
  CHECK(scene.finish_ms(1) == 7);
  CHECK(scene.board->task(0).preempted_ns == 3 * kMs);
}

TEST_CASE("cooperative: nobody is preempted, a job that is due earlier waits") {
  VirtualScene scene(Policy::cooperative);
  scene.add("slow", 0, 10, 60);
  scene.add("quick", 4, 3, 20);
  scene.run();
  CHECK(scene.walkers["quick"].starts_ms == std::vector<int64_t>{10});
  CHECK(scene.finish_ms(0) == 10);
  CHECK(scene.finish_ms(1) == 13);
}

TEST_CASE("cooperative and deadline use every core of the plan") {
  for (const Policy policy : {Policy::cooperative, Policy::deadline}) {
    VirtualScene scene(policy, {2, 5});
    scene.add("one", 0, 10, 60);
    scene.add("two", 0, 10, 50);
    scene.add("three", 0, 10, 40);
    scene.run();
    CHECK(scene.walkers["three"].starts_ms == std::vector<int64_t>{0});
    CHECK(scene.walkers["two"].starts_ms == std::vector<int64_t>{0});
    CHECK(scene.walkers["one"].starts_ms == std::vector<int64_t>{10});
    CHECK(scene.board->task(2).jobs[0].cpu == 2);
    CHECK(scene.board->task(1).jobs[0].cpu == 5);
  }
}

TEST_CASE("deadline: the earliest absolute deadline runs, whoever came first") {
  VirtualScene scene(Policy::deadline);
  scene.add("patient", 0, 20, 90);
  scene.add("urgent", 5, 5, 30);
  scene.run();
  CHECK(scene.walkers["urgent"].starts_ms == std::vector<int64_t>{5});
  CHECK(scene.finish_ms(0) == 25);
}

TEST_CASE("a plan without cores lets nobody wait") {
  VirtualScene scene(Policy::fixed, {});
  scene.add("one", 0, 10, 60);
  scene.add("two", 0, 10, 60);
  scene.run();
  CHECK(scene.walkers["two"].starts_ms == std::vector<int64_t>{0});
}

TEST_CASE("what a job publishes is seen from the end of its preempted execution on") {
  VirtualScene scene(Policy::fixed);
  scene.add("source", 0, 10, 60);  // would be done at 10
  scene.add("other", 2, 5, 20);    // takes it 5 ms
  scene.add("reader", 12, 1, 90);  // latches at 12: nothing there yet
  scene.edge(0, 2);
  scene.run(200);
  CHECK(scene.finish_ms(0) == 15);
  CHECK(scene.walkers["reader"].seen == std::vector<int64_t>{-1, 0});
}

TEST_CASE("a job beyond its period: one release stays pending, those before it are skipped; all are told") {
  VirtualScene scene(Policy::fixed);
  scene.add("long", 0, 5, 100);
  // The job of the first release takes 250 ms; the release at 200 is still pending then, that at 100 has passed.
  scene.run(500, [](size_t, uint64_t job) { return job == 0 ? 250 * kMs : 5 * kMs; });
  CHECK(scene.walkers["long"].starts_ms == std::vector<int64_t>{0, 250, 300, 400});
  CHECK(scene.board->task(0).skipped.load() == 1);
  CHECK(scene.board->task(0).deadline_misses.load() == 1);
  CHECK(scene.board->task(0).budget_overruns.load() == 1);
}

TEST_CASE("of the releases that passed, those that their mode leaves out and those after the end are not skipped") {
  struct Case {
    OnMiss verb;
    int64_t for_ms;
    uint64_t skipped;
  };
  // The first job takes 1250 ms; releases 3 to 5 are left out. One stays pending (at 1200), unless `skip` drops it and
  // the late job itself.
  for (const Case& c : {Case{OnMiss::proceed, 2000, 8}, {OnMiss::skip, 2000, 10}, {OnMiss::proceed, 800, 4}}) {
    VirtualScene scene(Policy::fixed);
    scene.add("long", 0, 5, 100).on_miss = c.verb;
    scene.plan.modes = {{"full", {1}}, {"none", {0}}};
    scene.board = std::make_unique<RunBoard>(scene.plan);
    Modes& modes = scene.board->modes();
    CHECK(modes.request(1, kEpoch + 250 * kMs, "a test"));
    CHECK(modes.request(0, kEpoch + 600 * kMs, "a test"));
    CHECK(modes.request(1, kEpoch + 600 * kMs, "at the same instant"));
    CHECK(modes.request(0, kEpoch + 600 * kMs, "at the same instant"));
    scene.run(c.for_ms, [](size_t, uint64_t job) { return job == 0 ? 1250 * kMs : 5 * kMs; });
    CHECK(scene.board->task(0).skipped.load() == c.skipped);
  }
}

TEST_CASE("followers run in the order of their lane, on its CPU time, before its next release") {
  VirtualScene scene(Policy::cooperative);
  scene.add("head", 0, 5, 30);
  for (const char* name : {"left", "right"}) {
    TaskPlan& follower = scene.add(name, 0, 10, 30);
    follower.rate.reset();
    follower.on_task = 0;
    follower.on_port = scene.plan.tasks[0].ports[0];
  }
  scene.edge(0, 1);
  scene.edge(0, 2);
  scene.run(200);
  CHECK(scene.walkers["head"].starts_ms == std::vector<int64_t>{0, 100});
  CHECK(scene.walkers["left"].starts_ms == std::vector<int64_t>{5, 105});
  CHECK(scene.walkers["right"].starts_ms == std::vector<int64_t>{15, 115});
  CHECK(scene.walkers["right"].seen == std::vector<int64_t>{0, 1});
}
