// SPDX-License-Identifier: Apache-2.0
// What was proven beside what is seen, on jobs whose time is told: planted errors are found, and each cause is named.
#include <doctest/doctest.h>

#include <algorithm>

#include "graph/ace/ace_registry.hpp"
#include "graph/run/report.hpp"
#include "graph/run/support.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/task.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using takt::command::ProofReport;
using takt::command::RunFacts;
using test::kMs;
using test::kUs;
using Json = nlohmann::ordered_json;

constexpr int64_t kEpoch = 1'000 * kMs, kPeriod = 100 * kMs;

/// A real clock of which the test says what time it is.
struct HandClock final : Clock {
  int64_t now = kEpoch;
  int64_t now_ns() const override { return now; }
  bool is_virtual() const override { return false; }
};

struct Source final : Node {
  Output<Odometry> out{this, "out", "test data"};
  HandClock& clock;
  int64_t takes_ns = 10 * kMs, lag_ns = 0;
  bool silent = false;
  explicit Source(HandClock& c) : clock(c) {}
  void setup(Setup&) override {}
  void run(Job& job) override {
    clock.now += takes_ns;
    if (!silent && out.loan() != nullptr) out.send(job.release_ns() - lag_ns);
  }
};

struct Reader final : Node {
  Input<Odometry> in{this, "in", "test data"};
  Output<Odometry> out{this, "out", "test data"};
  HandClock& clock;
  explicit Reader(HandClock& c) : clock(c) {}
  void setup(Setup&) override {}
  void run(Job&) override {
    clock.now += 10 * kMs;
    if (in.newest() != nullptr && out.loan() != nullptr) out.send(in.stamp_ns());
  }
};

/// A source at 10 Hz and, 50 ms later, its reader, alone on their core; each job charged 0.1 ms beyond its budget
/// of 10.
struct Scene {
  HandClock clock;
  Source source{clock};
  Reader reader{clock};
  graph::GraphSpec graph;
  Plan plan;
  graph::CheckMachine machine;
  std::vector<Stall> stalls;
  int64_t latency_ns = 50 * kUs;  ///< what really comes before each job

  Scene() {
    test::add_task(plan, source, "source", 0);
    test::add_task(plan, reader, "reader", 50 * kMs);
    for (TaskPlan& task : plan.tasks) task.budget_ns = 10 * kMs;
    for (PortPlan& port : plan.ports) port.port = "out";
    plan.tasks[1].edges.push_back({0, 0, 1, 500 * kMs});
    plan.ports[0].held = plan.ports[0].readers = 1;
    plan.policy = Policy::fixed;
    plan.cores = {0};
    graph::ChainSpec chain;
    chain.name = "way";
    chain.from = {"source", "out"};
    chain.to = {"reader", "out"};
    chain.max_age_ns = 500 * kMs;
    graph.chains.push_back(chain);
    graph.name = "scene";
    machine.overheads.release_ns = 100 * kUs;
    machine.measured = true;
    machine.worst = machine.overheads;
  }

  /// The report of `jobs` jobs of each node; `before(job)` may plant something.
  template <class Before>
  Json run(int jobs, const Before& before, Policy granted = Policy::fixed) {
    const graph::CheckResult check = graph::check(graph, plan, {machine});
    REQUIRE_MESSAGE(check.admitted, check.text);
    const graph::Proofs proofs = graph::proofs_of(plan, check, machine);
    const auto transport = make_local_transport(plan.ports);
    board = std::make_unique<RunBoard>(plan);
    command::tell_bounds(graph, plan, proofs, *board);
    Task first(plan, 0, *transport, clock, *board), second(plan, 1, *transport, clock, *board);
    take_thread_use();  // of what came before
    clock.now = kEpoch;
    for (int job = 0; job < jobs; ++job) {
      before(job);
      for (Task* task : {&first, &second}) {
        const int64_t release_ns = kEpoch + job * kPeriod + task->plan().offset_ns;
        clock.now = std::max(clock.now, release_ns + latency_ns);
        task->run(static_cast<uint64_t>(job), release_ns);
        task->count(0);
      }
    }
    StallLog log;
    for (const Stall& stall : stalls) log.add(stall);
    static const Registry known = ace_registry();
    RunResult result;
    result.epoch_ns = kEpoch;
    result.end_ns = kEpoch + jobs * kPeriod;
    result.policy_granted = granted;
    result.released = {static_cast<uint64_t>(jobs), static_cast<uint64_t>(jobs)};
    Json report = command::make_report(
        RunFacts{known, graph, plan, *board, result, *transport, {}, "real", "fixed", "none", {}, {}, proofs, log});
    exit = command::run_exit(*board, granted, report);
    return report;
  }
  Json run(int jobs) {
    return run(jobs, [](int) {});
  }

  std::unique_ptr<RunBoard> board;
  int exit = -1;
};

std::vector<std::string> above(const Json& report, const std::string& cause) {
  std::vector<std::string> names;
  for (const Json& row : report["proofs"]["above_proof"])
    if (row["cause"] == cause) names.push_back(row["what"]);
  return names;
}
using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("proofs: what was proven stands beside what was seen, and holds") {
  Scene scene;
  const Json report = scene.run(20);
  CHECK(report["proofs"]["verdict"] == "held");
  CHECK(report["proofs"]["compared"] == 4);  // two responses, an edge, a chain
  CHECK(report["proofs"]["assumptions"]["overheads"] == "worst");
  CHECK(report["proofs"]["assumptions"]["stall_ms"] == doctest::Approx(0.1));
  for (const Json& node : report["nodes"]) {
    CHECK(node["response_ms"]["proven_ms"] == doctest::Approx(10.1));
    CHECK(node["response_ms"]["max"] <= node["response_ms"]["proven_ms"]);
  }
  CHECK(report["edges"][0]["age_ms"]["max"] <= report["edges"][0]["age_ms"]["proven_ms"]);
  CHECK(report["chains"][0]["age_ms"]["max"] <= report["chains"][0]["age_ms"]["proven_ms"]);
  CHECK(scene.exit == 0);
  CHECK(command::summary_text(report).find("proofs held: 4 figures") != std::string::npos);
}

TEST_CASE("proofs: a chain may end at an input, and is seen there") {
  Scene scene;
  const std::string input(scene.reader.inputs()[0]->name());
  scene.graph.chains[0].to = {"reader", input};
  const Json report = scene.run(20);
  const Json& chain = report["chains"][0];
  CHECK(chain["within"] == true);
  CHECK(chain["age_ms"]["max"] > 0);
  CHECK(chain["age_ms"] == report["edges"][0]["age_ms"]);
}

TEST_CASE("proofs: a planted overhead, larger than charged, is unexplained, told first, and the run is not ok") {
  Scene scene;
  scene.latency_ns = 300 * kUs;
  const Json report = scene.run(20);
  CHECK(report["proofs"]["verdict"] == "unexplained");
  CHECK(above(report, "unexplained") ==
        Names{"response of source", "response of reader", "age at source.out -> reader.in", "age of chain way"});
  const Json& row = report["proofs"]["above_proof"][0];
  CHECK(row["proven_ms"] == doctest::Approx(10.1));
  CHECK(row["observed_ms"] == doctest::Approx(10.3));
  CHECK(row["samples_above"] == 20);
  CHECK(row["of"] == 20);
  CHECK(scene.exit == 1);
  CHECK(command::summary_text(report).starts_with("\nNOT AS PROVEN: response of source 10.300 ms, proven 10.100 ms"));
}

TEST_CASE("proofs: a planted late publication is unexplained, where it happens and where it makes data old") {
  Scene scene;
  const Json report = scene.run(20, [&](int job) { scene.source.takes_ns = job == 10 ? 60 * kMs : 10 * kMs; });
  CHECK(report["proofs"]["verdict"] == "unexplained");
  const Names names = above(report, "unexplained");
  for (const char* name : {"response of source", "response of reader", "age at source.out -> reader.in"})
    CHECK(std::find(names.begin(), names.end(), name) != names.end());
  CHECK(report["proofs"]["above_proof"][0]["samples_above"] == 1);
  CHECK(scene.exit == 1);
}

TEST_CASE("proofs: a planted lag of a device, longer than was told, is unexplained in the ages alone") {
  Scene scene;
  scene.source.lag_ns = 30 * kMs;
  const Json report = scene.run(20);
  CHECK(above(report, "unexplained") == Names{"age at source.out -> reader.in", "age of chain way"});
  CHECK(scene.exit == 1);
}

TEST_CASE("proofs: a double's lateness excuses as much and no more") {
  Scene scene;
  scene.source.lag_ns = 30 * kMs;
  const Json report = scene.run(20);
  double most_ms = 0;
  for (const Json& row : report["proofs"]["above_proof"])
    most_ms = std::max(most_ms, row["observed_ms"].get<double>() - row["proven_ms"].get<double>());
  const auto excess_ns = static_cast<int64_t>(most_ms * 1e6) + 1'000;
  const auto run = [&](int64_t late_ns) {
    return scene.run(20, [&](int job) { scene.board->late_sources().append({0, kEpoch + job * kPeriod, late_ns}); });
  };
  CHECK(above(run(excess_ns), "double_late").size() == 2);
  CHECK(scene.exit == 0);
  CHECK(!above(run(excess_ns - kMs), "unexplained").empty());
  CHECK(scene.exit == 1);
}

TEST_CASE("proofs: a stall of the host breaks an assumption, and the exit code stays") {
  Scene scene;
  const auto stalled = [&](int job) { scene.source.takes_ns = job == 10 ? 60 * kMs : 10 * kMs; };
  const int64_t release_ns = kEpoch + 10 * kPeriod;
  scene.stalls = {{release_ns + 5 * kMs, release_ns + 55 * kMs, 50 * kMs, 0}};
  const Json report = scene.run(20, stalled);
  CHECK(report["proofs"]["verdict"] == "assumption_broken");
  CHECK(above(report, "unexplained").empty());
  REQUIRE(!above(report, "host_stall").empty());
  for (const Json& row : report["proofs"]["above_proof"]) {
    CHECK(row["stall_ms"] == doctest::Approx(50));
    CHECK(row["without_stalls_ms"] == doctest::Approx(std::max(0.0, row["observed_ms"].get<double>() - 50)));
  }
  CHECK(scene.exit == 0);
  CHECK(command::summary_text(report).find("host_stall 50.0 ms") != std::string::npos);

  scene.stalls[0].away_ns = 90 * kUs;  // what the overheads cover
  CHECK(scene.run(20, stalled)["proofs"]["verdict"] == "unexplained");
  scene.stalls = {{kEpoch, kEpoch + 50 * kMs, 50 * kMs, 0}};  // a second earlier
  CHECK(scene.run(20, stalled)["proofs"]["verdict"] == "unexplained");
  scene.stalls.assign(StallLog::kMost + 1, scene.stalls.front());  // more than are kept: there may have been later ones
  CHECK(scene.run(20, stalled)["proofs"]["verdict"] == "assumption_broken");
}

TEST_CASE("proofs: budgets that were not kept, processes that were away, messages that nobody made") {
  Scene scene;
  const int64_t release_ns = kEpoch + 10 * kPeriod;
  const auto late = [&](int job) { scene.source.takes_ns = job == 10 ? 60 * kMs : 10 * kMs; };
  Json report = scene.run(20, [&](int job) {
    late(job);
    if (job == 10) scene.board->overruns().append({0, release_ns, release_ns + 60 * kMs});
  });
  CHECK(report["proofs"]["verdict"] == "assumption_broken");
  CHECK(!above(report, "budget_overrun").empty());
  report = scene.run(20, [&](int job) {
    late(job);
    Outage outage;
    outage.from_ns = release_ns;
    outage.back_ns = release_ns + 20 * kMs;
    if (job == 10) scene.board->outages().add(outage);
  });
  CHECK(!above(report, "restart").empty());
  CHECK(above(report, "unexplained").empty());
  scene.source.takes_ns = 10 * kMs;
  report = scene.run(20, [&](int job) { scene.source.silent = job >= 10 && job < 13; });
  CHECK(above(report, "no_message") == Names{"age at source.out -> reader.in", "age of chain way"});
  CHECK(report["proofs"]["verdict"] == "assumption_broken");
}

TEST_CASE("proofs at p99: one sample in a hundred may be above, significantly more may not") {
  Scene scene;
  scene.machine.worst.reset();
  const auto some = [&](int every) {
    return scene.run(300, [&, every](int job) { scene.latency_ns = job % every == 0 ? 300 * kUs : 50 * kUs; });
  };
  Json report = some(100);
  CHECK(report["proofs"]["assumptions"]["overheads"] == "p99");
  CHECK(report["proofs"]["verdict"] == "held");
  CHECK(!above(report, "quantile").empty());
  CHECK(report["proofs"]["above_proof"][0]["chance"].get<double>() > 0.1);
  CHECK(scene.exit == 0);
  report = some(10);
  CHECK(report["proofs"]["verdict"] == "unexplained");
  CHECK(report["proofs"]["above_proof"][0]["chance"].get<double>() < 1e-3);
  CHECK(report["proofs"]["above_proof"][0]["samples_above"] == 30);
  CHECK(scene.exit == 1);
}

TEST_CASE("proofs: nothing is proven under cooperative, or where the policy was not granted") {
  Scene scene;
  scene.latency_ns = 300 * kUs;
  Json report = scene.run(
      20, [](int) {}, Policy::cooperative);
  CHECK(report["proofs"]["verdict"] == "none");
  CHECK(report["nodes"][0]["response_ms"]["proven_ms"].is_null());
  CHECK(report["nodes"][0]["response_ms"]["not_proven"] == "the policy fixed was not granted");
  CHECK(scene.exit == 0);
  scene.plan.policy = Policy::cooperative;
  report = scene.run(
      20, [](int) {}, Policy::cooperative);
  CHECK(report["proofs"]["verdict"] == "none");
  CHECK(report["nodes"][0]["response_ms"]["proven_ms"].is_null());
  CHECK(report["nodes"][0]["response_ms"]["estimated_ms"].get<double>() > 10);
  CHECK(command::summary_text(report).find("proven 1") == std::string::npos);
}

TEST_CASE("proofs: the chance of so many above is the sum over all outcomes") {
  const auto slowly = [](uint64_t above, uint64_t samples, double share) {
    std::vector<double> exactly{1.0};  // by how many are above, one sample after the other
    for (uint64_t n = 0; n < samples; ++n) {
      std::vector<double> next(exactly.size() + 1, 0.0);
      for (size_t k = 0; k < exactly.size(); ++k) {
        next[k] += exactly[k] * (1 - share);
        next[k + 1] += exactly[k] * share;
      }
      exactly = next;
    }
    double sum = 0;
    for (size_t k = above; k < exactly.size(); ++k) sum += exactly[k];
    return sum;
  };
  for (const uint64_t samples : {1, 20, 300})
    for (const uint64_t above : {0, 1, 3, 11, 20})
      if (above <= samples)
        CHECK(graph::chance_of(above, samples, 0.01) == doctest::Approx(slowly(above, samples, 0.01)));
  CHECK(graph::chance_of(1'500, 100'000, 0.01) < 1e-3);
  CHECK(graph::chance_of(1'000, 100'000, 0.01) > 0.4);
}
