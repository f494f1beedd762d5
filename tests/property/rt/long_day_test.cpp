// SPDX-License-Identifier: Apache-2.0
// A day of virtual time: release k comes at exactly k / rate, whatever the rate, and none is left out.
#include <doctest/doctest.h>

#include <cmath>
#include <deque>

#include "rt/memory/sanitized.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/shm/local_transport.hpp"
#include "tests/unit/rt/plans.hpp"

using namespace takt;

namespace {

__extension__ typedef __int128 Wide;
constexpr int64_t kOddEpoch = 1'234'567'891'011;  // no multiple of anything

/// Holds each of its releases against the fraction itself: the whole nanosecond at or before epoch + offset + k / rate.
struct Punctual final : Node {
  Output<Odometry> out{this, "out", ""};
  Rate rate;
  int64_t offset_ns = 0;
  int64_t count = 0, wrong = 0;
  /// k / rate in ns, times the numerator of the rate.
  Wide due(int64_t k) const { return Wide{k} * rate.denominator * 1'000'000'000; }
  void setup(Setup&) override {}
  void run(Job& job) override {
    const Wide exact = due(count), since_ns = job.release_ns() - kOddEpoch - offset_ns;
    if (since_ns * rate.numerator > exact || (since_ns + 1) * rate.numerator <= exact) ++wrong;
    if (job.index() != static_cast<uint64_t>(count)) ++wrong;
    ++count;
  }
};

}  // namespace

TEST_CASE("24 h of virtual time: release k at exactly k / rate") {
  constexpr int64_t kHours = kSlowdown > 1 ? 1 : 24;  // under a sanitizer one hour
  if (kHours < 24) MESSAGE("NOT RUN: 23 of the 24 h, for they take too long under a sanitizer");
  constexpr int64_t kDay_ns = kHours * 3600 * 1'000'000'000;
  Plan plan;
  plan.policy = Policy::deadline;
  plan.cores = {0, 1};
  std::deque<Punctual> nodes;
  // The thesis's rates, that of NTSC cameras, and two that no decimal fraction can say.
  for (const Rate rate :
       {Rate{15, 1}, Rate{10, 1}, Rate{7, 1}, Rate{5, 1}, Rate{2, 1}, Rate{30'000, 1001}, Rate{1, 3}, Rate{7, 11}}) {
    Punctual& node = nodes.emplace_back();
    node.rate = rate;
    node.offset_ns = static_cast<int64_t>(nodes.size()) * 1'000'003;
    test::add_task(plan, node, "punctual", node.offset_ns);
    TaskPlan& task = plan.tasks.back();
    task.name += std::to_string(nodes.size());
    task.rate = rate;
    task.deadline_ns = rate.period_ns();
    task.budget_ns = 100'000;
  }
  const auto transport = make_local_transport(plan.ports);
  VirtualClock clock(kOddEpoch);
  Executor::Options options;
  options.duration_ns = kDay_ns;
  Executor executor(plan, *transport, clock, options);
  const RunResult result = executor.run();
  CHECK(result.epoch_ns == kOddEpoch);
  int64_t checked = 0;
  for (size_t t = 0; t < nodes.size(); ++t) {
    CAPTURE(nodes[t].rate.numerator);
    CAPTURE(nodes[t].rate.denominator);
    CHECK(nodes[t].wrong == 0);
    const Wide day = Wide{kDay_ns - nodes[t].offset_ns} * nodes[t].rate.numerator;
    CHECK(nodes[t].due(nodes[t].count - 1) < day);  // the last one lies within the day,
    CHECK(nodes[t].due(nodes[t].count) >= day);     // the next one does not
    CHECK(result.released[t] == static_cast<uint64_t>(nodes[t].count));
    CHECK(executor.board().task(t).deadline_misses.load() == 0);
    CHECK(executor.board().task(t).skipped.load() == 0);
    checked += nodes[t].count;
  }
  MESSAGE(checked << " releases in " << kHours << " h of virtual time, each at exactly k / rate");
}
