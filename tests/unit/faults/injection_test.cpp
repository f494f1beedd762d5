// SPDX-License-Identifier: Apache-2.0
// A scenario bound to a plan: whom it strikes, when processes are due, how nodes are found unwell.
#include "graph/faults/injection.hpp"

#include "fixture.hpp"
#include "graph/faults/health.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

constexpr int64_t kEpoch = 1'000 * kMs;
constexpr size_t kPorts = 8;  // more than the plan has

std::string many(const std::string& faults) { return "takt: 1\nname: t\nseed: 3\nfaults: [" + faults + "]\n"; }

}  // namespace

TEST_CASE("strikes on processes are due once, in order, until an instant") {
  const GraphSpec graph = small_graph();
  Injection injection(sound(many("{kind: kill, target: stereo, every: 2s, from: 1s, to: 6s, for: 50ms},"
                                 "{kind: kill, target: plan, at: 2s}")),
                      graph, kPorts, false);
  auto due = injection.due(3'000 * kMs);
  REQUIRE(due.size() == 2);
  CHECK(due[0].process == "depth");
  CHECK(due[0].at_ns == 1'000 * kMs);
  CHECK(due[0].for_ns == 50 * kMs);
  CHECK(due[1].process == "plan");
  CHECK(due[1].fault == 1);
  CHECK(injection.due(3'000 * kMs).empty());
  due = injection.due(100'000 * kMs);
  REQUIRE(due.size() == 2);
  CHECK(due[0].at_ns == 3'000 * kMs);
  CHECK(due[1].at_ns == 5'000 * kMs);
  CHECK(injection.struck_nodes() == std::vector<std::string>{"stereo", "planner"});
}

TEST_CASE("any: every process has its turn, the same for the same seed") {
  const GraphSpec graph = small_graph();
  const std::string text = many("{kind: kill, target: any, every: 100ms, to: 10s}");
  const Injection one(sound(text), graph, kPorts, false), other(sound(text), graph, kPorts, false);
  std::map<std::string, int> strikes;
  for (size_t i = 0; i < one.process_strikes().size(); ++i) {
    CHECK(one.process_strikes()[i].process == other.process_strikes()[i].process);
    ++strikes[one.process_strikes()[i].process];
  }
  CHECK(strikes.size() == 3);
  for (const auto& [process, count] : strikes) CHECK(count > 15);
}

TEST_CASE("whose jobs the faults strike: not the producers of struck messages") {
  const GraphSpec graph = small_graph();
  CHECK(Injection(sound(many("{kind: drop, target: stereo.disparity}")), graph, kPorts, false).struck_nodes().empty());
  CHECK(
      Injection(sound(many("{kind: exhausted_pool, target: stereo.disparity}")), graph, kPorts, false).struck_nodes() ==
      std::vector<std::string>{"stereo"});
  CHECK(Injection(sound(many("{kind: hang, target: planner, at: 1s, for: 0s}")), graph, kPorts, false).struck_nodes() ==
        std::vector<std::string>{"planner"});
  CHECK(Injection(sound(many("{kind: frozen, target: camera}")), graph, kPorts, false).struck_nodes() ==
        std::vector<std::string>{"camera"});
}

TEST_CASE("jobs are disturbed where the scenario says, and only there") {
  const GraphSpec graph = small_graph();
  Plan plan = small_plan();
  Injection injection(sound(many("{kind: slow_consumer, target: stereo, from: 1s, to: 2s, by: 5ms},"
                                 "{kind: kill, target: plan, at: 3s, for: 100ms}")),
                      graph, kPorts, false);
  VirtualClock clock(kEpoch);
  const std::atomic<int64_t> epoch{kEpoch};
  injection.disturb(plan, clock, epoch);
  CHECK(plan.tasks[0].disturbance == nullptr);
  REQUIRE(plan.tasks[1].disturbance != nullptr);
  REQUIRE(plan.tasks[2].disturbance != nullptr);
  CHECK(plan.tasks[2].disturbance->admits(kEpoch + 2'999 * kMs));
  CHECK_FALSE(plan.tasks[2].disturbance->admits(kEpoch + 3'000 * kMs));
  CHECK_FALSE(plan.tasks[2].disturbance->admits(kEpoch + 3'099 * kMs));
  CHECK(plan.tasks[2].disturbance->admits(kEpoch + 3'100 * kMs));
  CHECK(injection.struck() == std::vector<uint64_t>{0, 2});
  const auto durations = injection.durations({}, plan);
  CHECK(durations(1, 0) == 1 * kMs);
  clock.advance_to(kEpoch + 1'500 * kMs);
  CHECK(durations(1, 0) == 6 * kMs);
  CHECK(durations(0, 0) == 1 * kMs);
  const auto given = injection.durations([](size_t, uint64_t) { return 3 * kMs; }, plan);
  CHECK(given(1, 0) == 8 * kMs);
}

TEST_CASE("message faults reach the transport of the plan, with room for them, and are counted by fault") {
  const GraphSpec graph = small_graph();
  Plan plan = small_plan();
  Injection injection(sound(many("{kind: hang, target: planner, at: 1s, for: 0s},"
                                 "{kind: drop, target: planner.motion, from: 0s, to: 1s},"
                                 "{kind: delay, target: stereo.disparity, by: 500ms}")),
                      graph, kPorts, false);
  injection.make_room(plan);
  CHECK(plan.ports[1].history == 4 + 5);
  CHECK(plan.ports[2].history == 4);
  VirtualClock clock(kEpoch);
  const std::atomic<int64_t> epoch{kEpoch};
  const auto transport = injection.wrap(make_local_transport(plan.ports), plan, clock, epoch);
  const auto writer = transport->make_writer(2);
  REQUIRE(writer->loan() != nullptr);
  writer->publish(kEpoch, kEpoch, kEpoch);
  CHECK(injection.struck() == std::vector<uint64_t>{0, 1, 0});
  CHECK(injection.unaccounted([&](size_t port) { return port == 2 ? writer->statistics().sent : 0; }) == 0);
  CHECK_MESSAGE(injection.unaccounted([](size_t) { return 3; }) == 6, "three too many on each of two outputs");
}

TEST_CASE("a scenario without message faults leaves the transport as it is") {
  const GraphSpec graph = small_graph();
  const Plan plan = small_plan();
  Injection injection(sound(many("{kind: kill, target: plan, at: 3s}")), graph, kPorts, false);
  auto inner = make_local_transport(plan.ports);
  const Transport* before = inner.get();
  VirtualClock clock(kEpoch);
  const std::atomic<int64_t> epoch{kEpoch};
  CHECK(injection.wrap(std::move(inner), plan, clock, epoch).get() == before);
  CHECK(injection.unaccounted([](size_t) { return 5; }) == 0);
}

namespace {

/// A run at 10 Hz with deadlines of 100 ms that somebody looks after.
struct Patients {
  Plan plan = small_plan();
  RunBoard board{plan};
  HealthWatch watch{plan, board};

  /// All nodes but `without` end job `index`.
  void job(int64_t index, size_t without = kNone) {
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      if (t == without) continue;
      TaskStatistics& s = board.task(t);
      s.jobs[s.job_count % s.jobs.size()] = {kEpoch + index * 100 * kMs, 0, 0, 0};
      ++s.job_count;
    }
  }
  /// Who was found unwell then, since the epoch.
  std::vector<std::string> look(int64_t ms) {
    const size_t before = watch.unwell().size();
    watch.look(kEpoch + ms * kMs, kEpoch);
    std::vector<std::string> nodes;
    for (size_t i = before; i < watch.unwell().size(); ++i) {
      CHECK(watch.unwell()[i].at_ns == ms * kMs);
      nodes.push_back(watch.unwell()[i].node);
    }
    return nodes;
  }
};

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("health: a job that does not end is noticed once, when it should have ended; later ones are not blamed") {
  Patients patients;
  patients.watch.look(kEpoch, 0);  // no epoch yet
  CHECK(patients.watch.unwell().empty());
  patients.job(0);
  patients.job(1);
  CHECK(patients.look(150).empty());
  patients.job(2, 1);
  CHECK(patients.look(250).empty());
  CHECK(patients.look(299).empty());  // too early to look again
  CHECK(patients.look(310) == Names{"stereo"});
  patients.job(3);
  CHECK(patients.look(410).empty());
  for (int64_t n = 4; n < 100; ++n) {
    patients.job(n);
    for (const int64_t ms : {10, 70}) CHECK(patients.look(n * 100 + ms).empty());
  }
}

TEST_CASE("health: stale inputs, skipped jobs and jobs without result; releases that requests paused are none") {
  Patients patients;
  patients.board.edge(2, 0).stale = 1;
  CHECK(patients.look(50) == Names{"planner"});
  CHECK(patients.look(100).empty());
  patients.board.task(0).skipped = 1;
  patients.board.task(1).no_result = 2;
  patients.job(0);
  CHECK(patients.look(150) == Names{"camera", "stereo"});
  patients.job(1, 2);
  patients.board.task(2).paused = 1;
  CHECK(patients.look(250).empty());
  patients.job(2, 2);
  CHECK(patients.look(350) == Names{"planner"});
}

TEST_CASE("health: who waits for somebody that is not asked to run is well") {
  Patients patients;
  const size_t producer = PortProducers(patients.plan).find(patients.plan.tasks[2].edges[0].port);
  patients.job(0, producer);
  patients.board.task(producer).paused = 1;
  patients.board.edge(2, 0).stale = 1;
  CHECK(patients.look(150).empty());
  patients.job(1);
  patients.board.edge(2, 0).stale = 2;
  CHECK(patients.look(250) == Names{"planner"});
}
