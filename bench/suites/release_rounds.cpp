// SPDX-License-Identifier: Apache-2.0
#include "bench/suites/release_rounds.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <thread>

#include "bench/instants.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/rendezvous.hpp"

namespace takt::bench {
namespace {

constexpr int64_t kBudgetNs = 5'000'000;

/// The nodes of a round, the fastest first.
struct ReleasePlan {
  size_t rate_index;
  Rate rate;
  int64_t offset_ns;
};
std::vector<ReleasePlan> release_plans() {
  std::vector<ReleasePlan> plans;
  for (size_t i = 0; i < std::size(kReleaseRates); ++i)
    for (size_t node = 0; node < kNodesAtEachRate; ++node) {
      const Rate rate{kReleaseRates[i], 1};
      plans.push_back(
          {i, rate, rate.period_ns() * static_cast<int64_t>(node) / static_cast<int64_t>(kNodesAtEachRate)});
    }
  return plans;
}

/// CPU time of the process between the first and the last note, all of its threads together.
class ProcessUse {
 public:
  void note() {
    last_ = {now_ns(), clock_ns(CLOCK_PROCESS_CPUTIME_ID)};
    if (first_.at_ns == 0) first_ = last_;
  }
  double us_per_second() const {
    return static_cast<double>(last_.cpu_ns - first_.cpu_ns) * 1e6 /
           static_cast<double>(std::max<int64_t>(last_.at_ns - first_.at_ns, 1));
  }

 private:
  struct Reading {
    int64_t at_ns = 0, cpu_ns = 0;
  };
  Reading first_, last_;
};

/// Does nothing but note when it was run.
class EmptyNode final : public Node {
 public:
  /// The fastest of them notes what the process uses.
  explicit EmptyNode(bool fastest) : fastest_(fastest) {}
  void setup(Setup&) override {}
  void run(Job& job) override {
    lateness_us.push_back(static_cast<double>(job.now_ns() - job.release_ns()) * 1e-3);
    if (fastest_) process_use.note();
  }
  std::vector<double> lateness_us;
  ProcessUse process_use;

 private:
  const bool fastest_;
};

int64_t deadline_of(const Rate& rate) { return rate.period_ns(); }

/// The same reservation that the executor gives a lane of that rate.
Reservation reservation(Policy policy, size_t rank, const Rate& rate) {
  if (policy == Policy::deadline) return deadline_reservation(kBudgetNs, deadline_of(rate), rate.period_ns());
  Reservation r;
  r.policy = policy;
  if (policy == Policy::fixed) {
    r.priority = 80 - static_cast<int>(rank);
    r.core = static_cast<int>(rank % 2) % static_cast<int>(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)));
  }
  return r;
}

}  // namespace

ReleaseRound nanosleep_round(Policy policy, std::string& refused) {
  const std::vector<ReleasePlan> plans = release_plans();
  ReleaseRound round;
  round.lateness_us.resize(std::size(kReleaseRates));
  std::vector<std::vector<double>> late(plans.size());
  std::vector<Grant> grants(plans.size());
  std::atomic<int64_t> epoch{0};
  Rendezvous ready(plans.size() + 1), go(plans.size() + 1);
  ProcessUse process_use;
  std::vector<std::thread> threads;
  for (size_t i = 0; i < plans.size(); ++i) {
    late[i].reserve(64);
    threads.emplace_back([&, i] {
      const Rate& rate = plans[i].rate;
      grants[i] = apply(reservation(policy, i, rate));
      ready.arrive_and_wait();
      go.arrive_and_wait();
      const int64_t first = epoch + plans[i].offset_ns;
      for (int64_t k = 0; rate.release_ns(first, k) < epoch + kRoundNs; ++k) {
        sleep_until(rate.release_ns(first, k));
        late[i].push_back(static_cast<double>(now_ns() - rate.release_ns(first, k)) * 1e-3);
        if (i == 0) process_use.note();
      }
      if (policy == Policy::fixed) demote_thread(0);  // as the executor's: no release waits for the end of a thread
    });
  }
  ready.arrive_and_wait();
  epoch = now_ns() + 50'000'000;
  go.arrive_and_wait();
  for (std::thread& thread : threads) thread.join();
  for (size_t i = 0; i < plans.size(); ++i) {
    round.lateness_us[plans[i].rate_index].add(late[i]);
    const double deadline_us = static_cast<double>(deadline_of(plans[i].rate)) * 1e-3;
    round.missed += static_cast<uint64_t>(
        std::count_if(late[i].begin(), late[i].end(), [&](double us) { return us > deadline_us; }));
  }
  round.cpu_us = process_use.us_per_second();
  refused.clear();
  for (const Grant& grant : grants)
    if (!grant.refused.empty()) refused = grant.refused;
  return round;
}

ReleaseRound takt_round(Policy policy, int64_t anticipate_ns, std::string& granted) {
  const std::vector<ReleasePlan> plans = release_plans();
  std::vector<std::unique_ptr<EmptyNode>> nodes;
  Plan plan;
  plan.policy = policy;
  plan.anticipate_ns = anticipate_ns;
  for (int cpu = 0; cpu < std::min(2L, sysconf(_SC_NPROCESSORS_ONLN)); ++cpu) plan.cores.push_back(cpu);
  for (const ReleasePlan& release : plans) {
    nodes.push_back(std::make_unique<EmptyNode>(nodes.empty()));
    nodes.back()->lateness_us.reserve(64);
    TaskPlan task;
    task.name = std::to_string(kReleaseRates[release.rate_index]) + "hz_" + std::to_string(nodes.size());
    task.node = nodes.back().get();
    task.rate = release.rate;
    task.offset_ns = release.offset_ns;
    task.deadline_ns = deadline_of(*task.rate);
    task.budget_ns = kBudgetNs;
    task.criticality = Criticality::high;
    plan.tasks.push_back(task);
  }
  MonotonicClock clock;
  const auto transport = make_local_transport({});
  Executor::Options options;
  options.duration_ns = kRoundNs;
  Executor executor(plan, *transport, clock, options);
  const RunResult result = executor.run();
  ReleaseRound round;
  round.lateness_us.resize(std::size(kReleaseRates));
  for (size_t i = 0; i < plans.size(); ++i) {
    const uint64_t ran = nodes[i]->lateness_us.size();
    round.lateness_us[plans[i].rate_index].add(nodes[i]->lateness_us);
    round.missed +=
        executor.board().task(i).deadline_misses.load() + (result.released[i] - std::min(result.released[i], ran));
  }
  round.cpu_us = nodes.front()->process_use.us_per_second();
  granted = to_string(result.policy_granted);
  for (const std::string& refused : result.refused) granted += "; " + refused;
  return round;
}

std::optional<Samples> cyclictest_round(Policy policy) {
  const std::string how = policy == Policy::fixed ? "--policy=fifo --priority=80 --affinity=0" : "--policy=other",
                    threads = std::to_string(kNodesAtEachRate),
                    loops = std::to_string(kReleaseRates[0] * kRoundNs / 1'000'000'000);
  // Its threads begin together; intervals that differ by 0.5 ms keep them from waiting for one another in each loop.
  const std::string command =
      "cyclictest --verbose --threads=" + threads + " --interval=66667 --distance=500 --loops=" + loops;
  std::FILE* pipe = popen((command + " " + how + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  Samples samples;
  char line[256];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    unsigned thread = 0, loop = 0;
    double late_us = 0;
    if (std::sscanf(line, " %u: %u: %lf", &thread, &loop, &late_us) == 3) samples.add(late_us);
  }
  if (pclose(pipe) != 0 || samples.size() == 0) return std::nullopt;
  return samples;
}

Samples ReleaseRound::all() const {
  Samples all;
  for (const Samples& rate : lateness_us) all.add(rate.values());
  return all;
}

double ReleaseRound::over_1ms() const {
  double count = 0;
  for (const Samples& rate : lateness_us)
    count += static_cast<double>(
        std::count_if(rate.values().begin(), rate.values().end(), [](double us) { return us > 1000; }));
  return count;
}

}  // namespace takt::bench
