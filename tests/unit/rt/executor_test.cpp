// SPDX-License-Identifier: Apache-2.0
// The executor in virtual time: releases, the latch rule, joins, lanes and on_miss without a real clock.
#include "rt/sched/executor.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

/// A source that sends its job index as an odometry x, stamped with its release.
struct IndexSource final : Node {
  Output<Odometry> out{this, "out", "test data"};
  int64_t last_job = -1;
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (last_job >= 0 && static_cast<int64_t>(job.index()) > last_job) return job.end_of_data();
    Odometry* message = out.loan();
    REQUIRE(message != nullptr);
    message->x_m = static_cast<double>(job.index());
    out.send(job.release_ns());
  }
};

/// Sends its job index, then asks for more until it is refused.
struct Flood final : Node {
  Output<Odometry> out{this, "out", "test data"};
  void setup(Setup&) override {}
  void run(Job& job) override {
    for (Odometry* message = out.loan(); message != nullptr; message = out.loan()) {
      CHECK(out.loan() == message);  // until it is sent
      message->x_m = static_cast<double>(job.index());
      out.send(job.release_ns());
    }
  }
};

/// Notes what it latched.
struct NotingSink final : Node {
  Input<Odometry> a{this, "a", "test data"};
  Input<Odometry> b{this, "b", "test data", takt::Need::optional};
  Output<Odometry> out{this, "out", "test data"};
  struct Seen {
    int64_t release_ns;
    std::vector<double> a, b;
    bool stale, fresh;
  };
  std::vector<Seen> seen;
  void setup(Setup&) override {}
  void run(Job& job) override {
    Seen s{job.release_ns(), {}, {}, a.stale(), a.is_new()};
    for (size_t i = 0; i < a.size(); ++i) s.a.push_back(a[i].x_m);
    for (size_t i = 0; i < b.size(); ++i) s.b.push_back(b[i].x_m);
    seen.push_back(s);
    if (out.loan() != nullptr) out.send(a.empty() ? 0 : a.stamp_ns());
  }
};

struct ExecutorBench {
  Plan plan;
  std::vector<Node*> nodes;
  VirtualClock clock{1'000'000'000};

  size_t add(Node& node, const std::string& name, std::optional<Rate> rate, int64_t offset, int64_t budget) {
    TaskPlan task;
    task.name = name;
    task.node = &node;
    task.rate = rate;
    task.offset_ns = offset;
    task.budget_ns = budget;
    task.deadline_ns = 100 * kMs;
    for (const OutputPort* output : node.outputs()) {
      task.ports.push_back(plan.ports.size());
      PortPlan port;
      port.node = name;
      port.port = output->name();
      port.type = &output->type();
      port.history = 16;
      plan.ports.push_back(port);
    }
    plan.tasks.push_back(task);
    return plan.tasks.size() - 1;
  }
  void edge(size_t from, size_t to, size_t input, uint32_t depth = 1, int64_t max_age = 0) {
    const size_t port = plan.tasks[from].ports[0];
    plan.tasks[to].edges.push_back({input, port, depth, max_age});
    plan.ports[port].held += depth;
    PortAccess::connect(*plan.tasks[to].node->inputs()[input], {});
  }
  RunResult run(int64_t duration_ns, const std::function<void(Executor&)>& look = {}, RunBoard* board = nullptr) {
    const auto transport = make_local_transport(plan.ports);
    Executor executor(plan, *transport, clock, {duration_ns, 0, false, board});
    const RunResult result = executor.run();
    if (look) look(executor);
    return result;
  }
};

}  // namespace

TEST_CASE("completed equals the releases computed from rate and window, for each rate of the thesis") {
  ExecutorBench bench;
  std::array<IndexSource, 5> sources;
  const std::array rates{Rate{15, 1}, Rate{10, 1}, Rate{7, 1}, Rate{5, 1}, Rate{2, 1}};
  for (size_t i = 0; i < rates.size(); ++i) bench.add(sources[i], "s" + std::to_string(i), rates[i], 3 * kMs, kMs);
  bench.run(20'000 * kMs, [&](Executor& executor) {
    for (size_t i = 0; i < rates.size(); ++i) {
      const auto expected = static_cast<uint64_t>(rates[i].releases_before(3 * kMs, 20'000 * kMs));
      CHECK(executor.tasks()[i]->statistics().completed.load() == expected);
      CHECK(executor.tasks()[i]->statistics().skipped.load() == 0);
    }
  });
}

TEST_CASE("a job that floods its output gets one message through; what it was refused is counted") {
  ExecutorBench bench;
  Flood flood;
  NotingSink sink;
  const size_t from = bench.add(flood, "flood", Rate{10, 1}, 0, 5 * kMs);
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 50 * kMs, kMs);
  bench.edge(from, to, 0);
  bench.run(1000 * kMs, [&](Executor& executor) {
    const WriterStatistics& pool = executor.board().port(0).writer;
    CHECK(pool.sent == 10);
    CHECK(pool.pool_empty == 10);
    CHECK(pool.peak_in_use < pool.chunks);
  });
  REQUIRE(sink.seen.size() == 10);
  for (size_t k = 0; k < 10; ++k) CHECK(sink.seen[k].a == std::vector<double>{static_cast<double>(k)});
}

TEST_CASE("a job latches the newest message visible at its planned release, not at its start") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink sink;
  const size_t from = bench.add(source, "source", Rate{10, 1}, 0, 5 * kMs);  // visible 5 ms after each release
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 4 * kMs, kMs);
  bench.edge(from, to, 0);
  bench.run(1000 * kMs);
  REQUIRE(sink.seen.size() == 10);
  CHECK(sink.seen[0].stale);
  for (size_t k = 1; k < 10; ++k) {
    REQUIRE(sink.seen[k].a.size() == 1);
    CHECK(sink.seen[k].a[0] == k - 1);  // message k becomes visible 1 ms after this release
  }
}

TEST_CASE("depth latches the newest n, oldest first, and tells which are new; every message is accounted for") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink sink;
  const size_t from = bench.add(source, "source", Rate{15, 1}, 0, kMs);
  const size_t to = bench.add(sink, "sink", Rate{2, 1}, 490 * kMs, kMs);
  bench.edge(from, to, 0, 4);
  bench.run(2000 * kMs, [&](Executor& executor) {
    const EdgeStatistics& edge = executor.tasks()[1]->latch().statistics(0);
    const uint64_t sent = executor.tasks()[0]->writer(0).statistics().sent;
    CHECK(edge.received == 16);
    CHECK(sent == 30);
    CHECK(edge.received + edge.dropped == 30);
    CHECK(executor.tasks()[0]->writer(0).statistics().in_use ==
          16);  // the ring keeps its history, nothing else is held
  });
  REQUIRE(sink.seen.size() == 4);
  CHECK(sink.seen[0].a == std::vector<double>{4, 5, 6, 7});
  CHECK(sink.seen[3].a == std::vector<double>{26, 27, 28, 29});
  CHECK(sink.seen[3].fresh);
}

TEST_CASE("a join latches the newest set with equal stamps, none is stale") {
  ExecutorBench bench;
  IndexSource fast, slow;
  NotingSink sink;
  const size_t a = bench.add(fast, "fast", Rate{10, 1}, 0, kMs);
  const size_t b = bench.add(slow, "slow", Rate{5, 1}, 0, 150 * kMs);  // same stamps, visible much later
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 50 * kMs, kMs);
  bench.edge(a, to, 0);
  bench.edge(b, to, 1);
  bench.plan.tasks[to].joins = {{0, 1}};
  bench.run(1000 * kMs, [&](Executor& executor) { CHECK(executor.tasks()[2]->statistics().stale_inputs.load() == 2); });
  REQUIRE(sink.seen.size() == 10);
  CHECK(sink.seen[0].stale);
  for (size_t k = 1; k < 10; ++k) {
    REQUIRE(sink.seen[k].a.size() == 1);
    const double slow_index = std::floor((static_cast<double>(k) * 100 + 50 - 150) / 200);
    if (slow_index < 0) continue;
    CHECK(sink.seen[k].b[0] == slow_index);
    CHECK(sink.seen[k].a[0] == 2 * slow_index);
  }
}

TEST_CASE("messages that are to be passed over are latched by no job, neither alone nor in a join") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink sink, joined;
  const size_t from = bench.add(source, "source", Rate{10, 1}, 0, kMs);
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 50 * kMs, kMs);
  bench.edge(from, to, 0, 2);
  const size_t both = bench.add(joined, "joined", Rate{10, 1}, 50 * kMs, kMs);
  bench.edge(from, both, 0);
  bench.edge(from, both, 1);
  bench.plan.tasks[both].joins = {{0, 1}};
  RunBoard board(bench.plan);
  for (EdgeStatistics* edge : {&board.edge(to, 0), &board.edge(both, 1)}) {
    edge->pass_over_from.store(4);  // the source's jobs 3 and 4
    edge->pass_over_to.store(5);
  }
  bench.run(1000 * kMs, {}, &board);
  REQUIRE(sink.seen.size() == 10);
  CHECK(sink.seen[2].a == std::vector<double>{1, 2});
  CHECK(sink.seen[3].a == std::vector<double>{2});
  CHECK(sink.seen[4].a.empty());
  CHECK(sink.seen[4].stale);
  CHECK(sink.seen[5].a == std::vector<double>{5});
  CHECK(sink.seen[6].a == std::vector<double>{5, 6});
  REQUIRE(joined.seen.size() == 10);
  for (const size_t k : {3, 4}) CHECK(joined.seen[k].a == std::vector<double>{2});  // the newest whole set
  CHECK(joined.seen[5].a == std::vector<double>{5});
  CHECK(board.edge(to, 0).in_hand.load() == 10);
  CHECK(board.task(to).in_job.load() == 0);
}

TEST_CASE("an input older than max_age is stale but still seen") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink sink;
  source.last_job = 100;
  const size_t from = bench.add(source, "source", Rate{1, 1}, 0, kMs);
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 50 * kMs, kMs);
  bench.edge(from, to, 0, 1, 300 * kMs);
  bench.run(1000 * kMs);
  CHECK_FALSE(sink.seen[2].stale);
  CHECK(sink.seen[3].stale);
  CHECK(sink.seen[3].a.size() == 1);
}

TEST_CASE("an `on` task runs once per publication of its producer, every n-th, and not more often than min_interval") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink all, second, spaced;
  const size_t from = bench.add(source, "source", Rate{10, 1}, 0, kMs);
  for (NotingSink* sink : {&all, &second, &spaced}) {
    const size_t to = bench.add(*sink, "sink", std::nullopt, 0, kMs);
    bench.edge(from, to, 0);
    bench.plan.tasks[to].on_task = from;
    bench.plan.tasks[to].on_port = 0;
  }
  bench.plan.tasks[2].every = 2;
  bench.plan.tasks[3].min_interval_ns = 250 * kMs;
  const RunResult result = bench.run(1000 * kMs);
  CHECK(result.released == std::vector<uint64_t>{10, 10, 5, 4});
  CHECK(all.seen.size() == 10);
  CHECK(all.seen[3].a[0] == 3);
  CHECK(second.seen[1].a[0] == 2);
  CHECK(spaced.seen[1].a[0] == 3);
}

TEST_CASE("the end of recorded data ends the run at that release, and jobs before it are finished") {
  ExecutorBench bench;
  IndexSource source, other;
  source.last_job = 4;
  bench.add(source, "source", Rate{10, 1}, 0, kMs);
  bench.add(other, "other", Rate{10, 1}, 30 * kMs, kMs);
  const RunResult result = bench.run(0);
  CHECK(result.released == std::vector<uint64_t>{5, 5});
}

TEST_CASE("a job released at the very instant at which the data end is not counted, even if it ran") {
  ExecutorBench bench;
  IndexSource source;
  NotingSink sink;
  source.last_job = 4;
  const size_t from = bench.add(source, "source", Rate{10, 1}, 0, kMs);
  const size_t to = bench.add(sink, "sink", Rate{10, 1}, 0, kMs);
  bench.plan.tasks[to].deadline_ns = 50 * kMs;  // earlier deadline: runs before the source finds out
  bench.edge(from, to, 0);
  const RunResult result = bench.run(2000 * kMs, [&](Executor& executor) {
    CHECK(sink.seen.size() == 6);
    CHECK(executor.tasks()[to]->statistics().completed.load() == 5);
    CHECK(executor.tasks()[from]->statistics().completed.load() == 5);
  });
  CHECK(result.released == std::vector<uint64_t>{5, 5});
}

TEST_CASE("late jobs: continue publishes, skip withholds, reuse_last repeats the old message") {
  for (const OnMiss verb : {OnMiss::proceed, OnMiss::skip, OnMiss::reuse_last}) {
    ExecutorBench bench;
    IndexSource source;
    NotingSink sink;
    const size_t from = bench.add(source, "source", Rate{10, 1}, 0, 20 * kMs);
    const size_t to = bench.add(sink, "sink", Rate{10, 1}, 90 * kMs, kMs);
    bench.edge(from, to, 0);
    bench.plan.tasks[from].deadline_ns = 10 * kMs;  // modelled to take 20: always late
    bench.plan.tasks[from].on_miss = verb;
    bench.run(1000 * kMs, [&](Executor& executor) {
      const TaskStatistics& s = executor.tasks()[0]->statistics();
      CHECK(s.deadline_misses.load() == 10);
      CHECK(s.completed.load() == (verb == OnMiss::proceed ? 10 : 0));
      CHECK(s.skipped.load() == (verb == OnMiss::skip ? 10 : 0));
      CHECK(s.reused.load() == (verb == OnMiss::reuse_last ? 10 : 0));
    });
    CHECK(sink.seen.back().a.size() == (verb == OnMiss::proceed ? 1 : 0));
  }
}

TEST_CASE("virtual time gives the same observations in every run") {
  const auto once = [] {
    ExecutorBench bench;
    IndexSource a, b;
    NotingSink sink;
    const size_t fast = bench.add(a, "a", Rate{15, 1}, 0, 7 * kMs);
    const size_t slow = bench.add(b, "b", Rate{7, 1}, 0, 11 * kMs);
    const size_t to = bench.add(sink, "sink", Rate{10, 1}, 0, kMs);
    bench.edge(fast, to, 0, 3);
    bench.edge(slow, to, 1, 2);
    bench.run(3000 * kMs);
    std::vector<double> trace;
    for (const auto& seen : sink.seen) {
      trace.insert(trace.end(), seen.a.begin(), seen.a.end());
      trace.insert(trace.end(), seen.b.begin(), seen.b.end());
    }
    return trace;
  };
  CHECK(once() == once());
}
