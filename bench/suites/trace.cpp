// SPDX-License-Identifier: Apache-2.0
// What tracing costs: a job that notes its events against the same job that notes none, and the CPU time of a whole run
// with collector and the kernel's switches against the same run without.
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <memory>
#include <optional>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/trace/collector.hpp"

namespace takt::bench {

std::vector<Row> run_trace(const Options& options);

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr size_t kNodes = 14, kJobsPerBatch = 200, kBatches = 200;
constexpr int64_t kRunNs = 2'000 * kMs;

/// One input, one output, no work.
class PassNode final : public Node {
 public:
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (out_.loan() != nullptr) out_.send(in_.empty() ? job.release_ns() : in_.stamp_ns());
  }

 private:
  Input<Odometry> in_{this, "in", "the one before"};
  Output<Odometry> out_{this, "out", "for the next"};
};

/// Nodes in a ring, each reading the one before: every edge is sampled.
struct Ring {
  std::array<PassNode, kNodes> nodes;
  Plan plan;

  explicit Ring(Policy policy) {
    plan.policy = policy;
    plan.cores = {0};
    if (sysconf(_SC_NPROCESSORS_ONLN) > 1) plan.cores.push_back(1);
    for (size_t i = 0; i < kNodes; ++i) {
      PortPlan port;
      port.node = "node" + std::to_string(i);
      port.port = "out";
      port.type = &nodes[i].outputs()[0]->type();
      port.history = 4;
      port.held = 1;
      port.readers = 1;
      plan.ports.push_back(port);
      TaskPlan task;
      task.name = port.node;
      task.node = &nodes[i];
      task.rate = Rate{15, 1};
      task.offset_ns = static_cast<int64_t>(i) * 4 * kMs;
      task.deadline_ns = 60 * kMs;
      task.budget_ns = kMs;
      task.ports = {i};
      task.edges = {{0, (i + kNodes - 1) % kNodes, 1, 0}};
      PortAccess::connect(*nodes[i].inputs()[0], {});
      plan.tasks.push_back(task);
    }
  }
};

/// Jobs of two neighbours of the ring in turn, without executor. They are traced while the thread has a ring of events.
class JobLoop {
 public:
  JobLoop() : ring_(Policy::cooperative), transport_(make_local_transport(ring_.plan.ports)), board_(ring_.plan) {
    for (size_t i = 0; i < 2; ++i) tasks_[i].emplace(ring_.plan, i, *transport_, clock_, board_);
  }
  /// us per job, mean over a batch.
  double batch_us() {
    const int64_t begin = clock_.now_ns();
    for (size_t i = 0; i < kJobsPerBatch; ++i) {
      for (auto& task : tasks_) {
        task->run(index_, clock_.now_ns());
        task->count(0);
      }
      ++index_;
    }
    return static_cast<double>(clock_.now_ns() - begin) / 1e3 / (2 * kJobsPerBatch);
  }

 private:
  Ring ring_;
  MonotonicClock clock_;
  std::unique_ptr<Transport> transport_;
  RunBoard board_;
  std::array<std::optional<Task>, 2> tasks_;
  uint64_t index_ = 0;
};

void measure_burst(std::vector<Row>& rows) {
  std::fprintf(stderr, "trace: cost of a job's events\n");
  JobLoop loop;
  trace::Rings rings(1);
  trace::Ring* ring = rings.claim("bench");
  uint64_t events = 0;
  loop.batch_us();  // caches
  const Compared figures = compare(
      kBatches, [&] { return loop.batch_us(); },
      [&] {
        trace::detail::thread_ring = ring;
        const double us = loop.batch_us();
        trace::detail::thread_ring = nullptr;
        ring->drain([&](const trace::Event&) { ++events; });
        return us;
      });
  const std::string lost = ring->lost() > 0 ? std::to_string(ring->lost()) + " events lost" : "no event lost";
  add_pair(rows, {"trace/job/traced", "us", 0, figures.changed, {}, {}, {}, lost}, "the same job, not traced",
           figures.pairs);
  rows.push_back({"trace/job_burst/cost",
                  "us",
                  figures.cost.quantile(0.5).value_or(0),
                  figures.cost,
                  {},
                  {},
                  {},
                  std::to_string(events / (2 * kJobsPerBatch * kBatches)) + " events a job, " + lost});
}

double process_cpu_ms() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto ms = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_usec) / 1e3;
  };
  return ms(use.ru_utime) + ms(use.ru_stime);
}

/// CPU time of this process over a run of 14 empty nodes at 15 Hz, in percent of one CPU. `granted`: what the kernel
/// gave; of a traced run also where its switches came from and what was lost.
double run_pct(bool traced, std::string& granted) {
  Ring ring(Policy::fixed);
  MonotonicClock clock;
  const auto transport = make_local_transport(ring.plan.ports);
  std::optional<trace::Rings> rings;
  std::optional<trace::Collector> collector;
  if (traced) {
    rings.emplace(kNodes + 4);
    collector.emplace(*rings, trace::Collector::Options{ring.plan.cores});
  }
  Executor::Options options;
  options.duration_ns = kRunNs;
  options.trace = traced ? &*rings : nullptr;
  Executor executor(ring.plan, *transport, clock, options);
  const double before = process_cpu_ms();
  const RunResult result = executor.run();
  const double used = process_cpu_ms() - before;
  granted = to_string(result.policy_granted);
  if (traced) {
    const trace::Recording recording = collector->finish();
    granted += std::string(", switches from ") + trace::to_string(recording.source) + ", " +
               std::to_string(recording.switches.slices.size()) + " slices, lost " +
               std::to_string(recording.losses.events + recording.losses.switches);
  }
  return used / (static_cast<double>(kRunNs) / 1e6) * 100;
}

void measure_run(int rounds, std::vector<Row>& rows) {
  std::fprintf(stderr, "trace: CPU time of a run\n");
  std::string granted, plain;
  const Compared figures = compare(
      static_cast<size_t>(rounds), [&] { return run_pct(false, plain); }, [&] { return run_pct(true, granted); });
  add_pair(rows, {"trace/cpu/traced", "% of a CPU", 0, figures.changed, {}, {}, {}, granted},
           "the same run, not traced", figures.pairs);
  rows.push_back(
      {"trace/cpu/cost", "% of a CPU", figures.cost.quantile(0.5).value_or(0), figures.cost, {}, {}, {}, granted});
}

}  // namespace

std::vector<Row> run_trace(const Options& options) {
  std::vector<Row> rows;
  measure_burst(rows);
  measure_run(options.rounds_or(8), rows);
  return rows;
}

}  // namespace takt::bench
