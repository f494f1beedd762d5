// SPDX-License-Identifier: Apache-2.0
// Faults of jobs in virtual time: slower, hanging, gone; and that a run without any is as it was.
#include "rt/faults/node_faults.hpp"

#include <doctest/doctest.h>

#include "epoch.hpp"
#include "plans.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/shm/local_transport.hpp"

namespace {

using namespace takt;
using namespace takt::faults;
using test::kEpoch, test::kMs;

struct Counter final : Node {
  Output<Odometry> out{this, "out", ""};
  std::vector<int64_t> releases_ms;
  void setup(Setup&) override {}
  void run(Job& job) override {
    releases_ms.push_back((job.release_ns() - kEpoch) / kMs);
    if (out.loan() != nullptr) out.send(job.release_ns());
  }
};

/// One node at 10 Hz with 1 ms of work and a deadline of 100 ms, for a second.
struct Run {
  Plan plan;
  Counter node;
  VirtualClock clock{kEpoch};
  std::unique_ptr<RunBoard> board;
  std::vector<std::atomic<uint64_t>> struck;
  RunResult result;

  explicit Run(std::vector<NodeFault> faults) : struck(faults.size()) {
    test::add_task(plan, node, "node", 0);
    plan.cores = {0};
    board = std::make_unique<RunBoard>(plan);
    std::vector<std::atomic<uint64_t>*> counts;
    for (auto& count : struck) counts.push_back(&count);
    NodeFaults disturbance(std::move(faults), clock, board->epoch_ns(), counts);
    plan.tasks[0].disturbance = &disturbance;
    const auto transport = make_local_transport(plan.ports);
    Executor::Options options;
    options.duration_ns = 1'000 * kMs;
    options.board = board.get();
    options.job_duration_ns = [&](size_t, uint64_t) { return plan.tasks[0].budget_ns + disturbance.extra_ns(); };
    result = Executor(plan, *transport, clock, options).run();
  }
  const TaskStatistics& counts() const { return board->task(0); }
};

NodeFault fault(NodeFaultKind kind, int64_t from_ms, int64_t to_ms, int64_t by_ms) {
  return {kind, 0, from_ms * kMs, to_ms * kMs, by_ms * kMs};
}

}  // namespace

TEST_CASE("slow: jobs that start in the window take longer, the others do not") {
  const Run run({fault(NodeFaultKind::slow, 200, 500, 120)});
  CHECK(run.struck[0] == 3);
  CHECK(run.counts().deadline_misses == 3);
  CHECK(run.counts().completed + run.counts().skipped == 10);
}

TEST_CASE("hang: the first job in the window, once") {
  const Run run({{NodeFaultKind::hang, 0, 150 * kMs, kForever, 350 * kMs}});
  CHECK(run.struck[0] == 1);
  CHECK(run.counts().deadline_misses >= 1);
  CHECK(run.counts().jobs[2].finish_ns == kEpoch + (200 + 351) * kMs);
  CHECK(run.counts().jobs[1].finish_ns == kEpoch + 101 * kMs);
}

TEST_CASE("hang for ever: nothing of the node comes after it") {
  const Run run({{NodeFaultKind::hang, 0, 250 * kMs, kForever, kForever}});
  CHECK(run.node.releases_ms == std::vector<int64_t>{0, 100, 200, 300});
  CHECK(run.result.released[0] == 10);
}

TEST_CASE("absent: releases of the window pass without a job, and are not completed") {
  const Run run({fault(NodeFaultKind::absent, 200, 500, 0)});
  CHECK(run.struck[0] == 3);
  CHECK(run.node.releases_ms == std::vector<int64_t>{0, 100, 500, 600, 700, 800, 900});
  CHECK(run.result.released[0] == 10);
  CHECK(run.counts().completed == 7);
  CHECK(run.counts().skipped == 0);
  CHECK(run.counts().paused == 0);
}

TEST_CASE("what lies outside of its window does not strike") {
  const Run run({fault(NodeFaultKind::slow, 2'000, 3'000, 50),
                 fault(NodeFaultKind::absent, 2'000, 3'000, 0),
                 {NodeFaultKind::hang, 0, 2'000 * kMs, kForever, kForever}});
  for (const auto& count : run.struck) CHECK(count == 0);
  CHECK(run.counts().completed == 10);
  CHECK(run.counts().deadline_misses == 0);
}
