// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/trace/collector.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

struct PlainSource final : Node {
  Output<Odometry> out{this, "out", "test data"};
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (out.loan() != nullptr) out.send(job.release_ns());
  }
};
struct PlainSink final : Node {
  Input<Odometry> in{this, "in", "test data"};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

/// A source at 10 Hz and a sink on it, both in virtual time; the sink's budget is beyond its deadline.
trace::Trace traced_run(bool traced) {
  PlainSource source;
  PlainSink sink;
  Plan plan;
  plan.ports.resize(1);
  plan.ports[0].node = "source", plan.ports[0].port = "out", plan.ports[0].type = &source.out.type();
  plan.ports[0].history = 8, plan.ports[0].held = 1;
  plan.tasks.resize(2);
  plan.tasks[0].name = "source", plan.tasks[0].node = &source, plan.tasks[0].rate = Rate{10, 1};
  plan.tasks[0].deadline_ns = 50 * kMs, plan.tasks[0].budget_ns = 5 * kMs, plan.tasks[0].ports = {0};
  plan.tasks[1].name = "sink", plan.tasks[1].node = &sink, plan.tasks[1].on_task = 0, plan.tasks[1].on_port = 0;
  plan.tasks[1].deadline_ns = 20 * kMs, plan.tasks[1].budget_ns = 21 * kMs, plan.tasks[1].edges = {{0, 0, 1, 0}};
  PortAccess::connect(sink.in, {});
  VirtualClock clock(1'000 * kMs);
  const auto transport = make_local_transport(plan.ports);
  trace::Rings rings(2);
  Executor::Options options;
  options.duration_ns = 1'000 * kMs;
  options.trace = traced ? &rings : nullptr;
  Executor(plan, *transport, clock, options).run();
  trace::Recording recording;
  for (size_t i = 0; i < rings.claimed(); ++i)
    rings.ring(i).drain([&](const trace::Event& event) { recording.events.push_back({7, event}); });
  return trace::assemble(recording);
}

}  // namespace

TEST_CASE("a run in virtual time leaves each job with its release, inputs, outputs and misses") {
  const trace::Trace trace = traced_run(true);
  REQUIRE(trace.jobs.size() == 20);
  for (size_t i = 0; i < trace.jobs.size(); ++i) {
    const trace::JobSpan& job = trace.jobs[i];
    const auto k = static_cast<int64_t>(i / 2);
    CHECK(job.job == static_cast<uint32_t>(k));
    CHECK(job.thread == 7);
    if (job.task == 0) {
      CHECK(job.release_ns == (1'000 + 100 * k) * kMs);
      CHECK(job.published_ns == job.release_ns + 5 * kMs);
      CHECK_FALSE(job.late);
      REQUIRE(job.published.size() == 1);
      CHECK(job.published[0].sequence == static_cast<uint64_t>(k + 1));
      CHECK(job.published[0].stamp_ns == job.release_ns);
    } else {
      CHECK(job.release_ns == (1'005 + 100 * k) * kMs);
      CHECK(job.late);
      CHECK(job.published_ns - job.deadline_ns == kMs);
      REQUIRE(job.latched.size() == 1);
      CHECK(job.latched[0].sequence == static_cast<uint64_t>(k + 1));
      CHECK(job.latched[0].stamp_ns == (1'000 + 100 * k) * kMs);
    }
  }
}

TEST_CASE("a run that is not traced notes nothing") { CHECK(traced_run(false).jobs.empty()); }

TEST_CASE("a wake-up meets the slice it was for, wherever it was recorded") {
  using trace::Slice;
  trace::Recording recording;
  recording.switches.names = {"x"};
  const auto slice = [](int64_t from, int64_t to, Slice::End end) { return Slice{from, to, 0, 5, 0, 1, 0, end}; };
  recording.switches.slices = {slice(200, 300, Slice::End::preempted), slice(100, 150, Slice::End::asleep),
                               slice(400, 500, Slice::End::asleep)};
  recording.switches.wakings = {{390, 5}, {180, 5}, {170, 6}, {160, 5}, {90, 5}};
  const trace::Trace trace = trace::assemble(recording);
  CHECK(trace.slices[0].woken_ns == 90);
  CHECK(trace.slices[1].woken_ns == 160);  // the first one since it fell asleep
  CHECK(trace.slices[2].woken_ns == 0);    // it had been preempted
}

TEST_CASE("a job whose end or beginning is missing is no job; skips and overruns are marks") {
  using trace::Kind;
  trace::Recording recording;
  recording.events = {{1, {10, 20, 0, 0, 0, Kind::release, 0}}, {1, {11, 0, 0, 0, 0, Kind::start, 0}},
                      {1, {50, 9, 0, 1, 0, Kind::finish, 0}},   {1, {51, 0, 0, 1, 0, Kind::publish, 0}},
                      {1, {99, 0, 0, 4, 0, Kind::skip, 0}},     {1, {60, 9, 5, 3, 0, Kind::overrun, 0}}};
  const trace::Trace trace = trace::assemble(recording);
  CHECK(trace.jobs.empty());
  REQUIRE(trace.marks.size() == 2);
  CHECK(trace.marks[0].kind == Kind::overrun);
  CHECK(trace.marks[1].job == 4);
}
