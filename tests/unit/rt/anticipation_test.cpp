// SPDX-License-Identifier: Apache-2.0
// Workers that are awake before their release: how early, at what cost, and that no job begins too early.
#include "rt/sched/anticipation.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;

namespace {

using Beside = Anticipation::Beside;
using test::kUs;

/// Every reading is that much after the one before.
class SteppingClock final : public Clock {
 public:
  SteppingClock(int64_t now_ns, int64_t step_ns) : now_ns_(now_ns), step_ns_(step_ns) {}
  int64_t now_ns() const override { return now_ns_ += step_ns_; }
  bool is_virtual() const override { return false; }

 private:
  mutable int64_t now_ns_;
  const int64_t step_ns_;
};

/// Notes by how much its jobs begin after their release.
class LateNode final : public Node {
 public:
  void setup(Setup&) override {}
  void run(Job& job) override { late_ns.push_back(job.now_ns() - job.release_ns()); }
  std::vector<int64_t> late_ns;
};

}  // namespace

TEST_CASE("anticipation: four of five wake-ups are in time, however long they take") {
  std::mt19937 random(3);
  for (const double typical_us : {3.0, 25.0, 120.0}) {
    CAPTURE(typical_us);
    Anticipation anticipation(500 * kUs, Beside::workers);
    std::exponential_distribution<double> beyond(4 / typical_us);
    int in_time = 0;
    constexpr int kSettle = 2000, kJobs = 10'000;
    for (int i = 0; i < kSettle + kJobs; ++i) {
      const auto took_ns = static_cast<int64_t>((typical_us + beyond(random)) * 1e3);
      if (i >= kSettle) in_time += took_ns <= anticipation.lead_ns() ? 1 : 0;
      anticipation.learn(took_ns);
    }
    CHECK(in_time > kJobs * 75 / 100);
    CHECK(in_time < kJobs * 90 / 100);
  }
}

TEST_CASE("anticipation: the lead stays within its bound, and one long wake-up moves it by four steps") {
  Anticipation anticipation(50 * kUs, Beside::workers);
  CHECK(anticipation.lead_ns() == 50 * kUs);
  for (int i = 0; i < 100; ++i) anticipation.learn(0);
  const int64_t least = anticipation.lead_ns();
  CHECK(least < Anticipation::kStep_ns);
  anticipation.learn(1'000'000 * kUs);
  CHECK(anticipation.lead_ns() == least + 4 * Anticipation::kStep_ns);
  for (int i = 0; i < 100; ++i) anticipation.learn(1'000'000 * kUs);
  CHECK(anticipation.lead_ns() == 50 * kUs);
}

TEST_CASE("anticipation: says whether something is left to wait for") {
  StopSignal stop;
  const int64_t release_ns = 1'000'000 * kUs;  // long past for the kernel: nobody sleeps here
  Anticipation anticipation(100 * kUs, Beside::workers);
  const auto wakes = [&](int64_t from_ns, int64_t to_ns) {  // asleep at the first reading, awake at the second
    return anticipation.sleep_before(release_ns, SteppingClock(2 * from_ns - to_ns, to_ns - from_ns), stop);
  };
  CHECK(wakes(release_ns - 130 * kUs, release_ns - 70 * kUs));  // took 30 us
  CHECK(anticipation.lead_ns() == 100 * kUs - Anticipation::kStep_ns);
  CHECK_FALSE(wakes(release_ns - 130 * kUs, release_ns + 5 * kUs));  // took all of it
  CHECK(anticipation.lead_ns() == 100 * kUs);
  // Who was at work until then was not woken late.
  CHECK(wakes(release_ns - 50 * kUs, release_ns - 10 * kUs));
  CHECK_FALSE(wakes(release_ns + 400 * kUs, release_ns + 410 * kUs));
  CHECK(anticipation.lead_ns() == 100 * kUs);
}

TEST_CASE("anticipation: a stop long before the release is not waited out") {
  StopSignal stop;
  stop.raise(1);
  Anticipation anticipation(100 * kUs, Beside::workers);
  const int64_t lead_ns = anticipation.lead_ns();
  CHECK_FALSE(anticipation.sleep_before(INT64_MAX / 2, SteppingClock(1, 0), stop));
  CHECK(anticipation.lead_ns() == lead_ns);
}

TEST_CASE("anticipation: without a lead nothing is waited for awake, whatever the clock says") {
  StopSignal stop;
  Anticipation anticipation(0, Beside::workers);
  CHECK(anticipation.lead_ns() == 0);
  CHECK_FALSE(anticipation.sleep_before(1'000, SteppingClock(1, 0), stop));
}

TEST_CASE("anticipation: without a real-time policy it begins asleep, and rests from the first CPU lost awake") {
  StopSignal stop;
  const int64_t release_ns = 1'000'000 * kUs;
  Anticipation anticipation(100 * kUs, Beside::everybody);
  CHECK(anticipation.lead_ns() == 0);
  for (int i = 0; i < 100; ++i) anticipation.learn(1'000'000 * kUs);
  CHECK(anticipation.lead_ns() == 100 * kUs);
  const SteppingClock in_time(release_ns - 100 * kUs, 0);
  const auto rests = [&] {
    int releases = 0;
    while (!anticipation.sleep_before(release_ns, in_time, stop)) ++releases;
    return releases;
  };
  const auto lose_cpu = [&](Anticipation& which) {  // the first look is before the release, the second far behind it
    constexpr int64_t kLost_ns = Anticipation::kLostCpu_ns;
    which.stay_awake_until(release_ns, SteppingClock(release_ns - 3 * kLost_ns, 2 * kLost_ns));
  };
  CHECK(rests() == 0);
  anticipation.stay_awake_until(release_ns, SteppingClock(release_ns - 50 * kUs, kUs));
  CHECK(rests() == 0);
  for (int rest = Anticipation::kShortestRest; rest <= Anticipation::kLongestRest; rest *= 2) {
    lose_cpu(anticipation);
    CHECK(rests() == rest);
  }
  lose_cpu(anticipation);
  CHECK(rests() == Anticipation::kLongestRest);

  // Beside workers only: who is more urgent may have the CPU.
  Anticipation worker(100 * kUs, Beside::workers);
  lose_cpu(worker);
  CHECK(worker.sleep_before(release_ns, in_time, stop));
}

TEST_CASE("anticipation: waits to the release, and what that costs is no job's") {
  const SteppingClock clock(0, 10);
  take_thread_use();
  Anticipation(100 * kUs, Beside::workers).stay_awake_until(2'000'000, clock);  // 200,000 readings: some milliseconds
  CHECK(clock.now_ns() == 2'000'010);
  CHECK(take_thread_use().cpu_ns < 1'000'000);
}

TEST_CASE("anticipation: no job begins before its release") {
  for (const Policy policy : {Policy::deadline, Policy::fixed, Policy::cooperative}) {
    LateNode nodes[3];
    Plan plan;
    plan.policy = policy;
    plan.anticipate_ns = 1'000 * kUs;
    plan.cores = {0};
    for (size_t i = 0; i < std::size(nodes); ++i) {
      TaskPlan task;
      task.name = "n" + std::to_string(i);
      task.node = &nodes[i];
      task.rate = Rate{i == 2 ? 70 : 40, 1};
      task.deadline_ns = task.rate->period_ns();
      task.budget_ns = 1'000 * kUs;
      plan.tasks.push_back(task);
    }
    MonotonicClock clock;
    const auto transport = make_local_transport({});
    Executor::Options options;
    options.duration_ns = 250'000 * kUs;
    Executor(plan, *transport, clock, options).run();
    for (const LateNode& node : nodes) {
      REQUIRE_FALSE(node.late_ns.empty());
      CHECK(*std::min_element(node.late_ns.begin(), node.late_ns.end()) >= 0);
    }
  }
}
