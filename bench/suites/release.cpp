// SPDX-License-Identifier: Apache-2.0
// Lateness of releases: five empty nodes at 15, 10, 7, 5 and 2 Hz under Takt's executor, against five threads that call
// clock_nanosleep under the same policy and reservation. Rounds A B A B ... A; idle, and beside two CPU hogs.
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>

#include "bench/suite.hpp"
#include "bench/suites/hops.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/rendezvous.hpp"

namespace takt::bench {

std::vector<Row> run_release(const Options& options);

namespace {

constexpr int64_t kRates[] = {15, 10, 7, 5, 2};
constexpr int64_t kRoundNs = 1'000'000'000, kBudgetNs = 5'000'000;

/// Does nothing but note when it was run.
class EmptyNode final : public Node {
 public:
  void setup(Setup&) override {}
  void run(Job& job) override { lateness_us.push_back(static_cast<double>(job.now_ns() - job.release_ns()) * 1e-3); }
  std::vector<double> lateness_us;
};

struct Round {
  Samples lateness_us;
  uint64_t released = 0, completed = 0;
  double over_1ms() const {
    const auto& values = lateness_us.values();
    return static_cast<double>(std::count_if(values.begin(), values.end(), [](double us) { return us > 1000; }));
  }
};

/// Child processes that never sleep.
class Hogs {
 public:
  explicit Hogs(int count) {
    for (int i = 0; i < count; ++i) {
      const pid_t pid = fork();
      if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (volatile uint64_t n = 0;;) n = n + 1;
      }
      if (pid > 0) pids_.push_back(pid);
    }
  }
  Hogs(const Hogs&) = delete;
  Hogs& operator=(const Hogs&) = delete;
  ~Hogs() {
    for (pid_t pid : pids_) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
    }
  }

 private:
  std::vector<pid_t> pids_;
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

Round raw_round(Policy policy, std::string& granted) {
  Round round;
  std::vector<std::vector<double>> late(std::size(kRates));
  std::vector<Grant> grants(std::size(kRates));
  std::atomic<int64_t> epoch{0};
  Rendezvous ready(std::size(kRates) + 1), go(std::size(kRates) + 1);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < std::size(kRates); ++i) {
    late[i].reserve(64);
    threads.emplace_back([&, i] {
      const Rate rate{kRates[i], 1};
      grants[i] = apply(reservation(policy, i, rate));
      ready.arrive_and_wait();
      go.arrive_and_wait();
      for (int64_t k = 0; rate.release_ns(epoch, k) < epoch + kRoundNs; ++k) {
        sleep_until(rate.release_ns(epoch, k));
        late[i].push_back(static_cast<double>(now_ns() - rate.release_ns(epoch, k)) * 1e-3);
      }
    });
  }
  ready.arrive_and_wait();
  epoch = now_ns() + 50'000'000;
  go.arrive_and_wait();
  for (std::thread& thread : threads) thread.join();
  for (const auto& l : late) round.lateness_us.add(l);
  granted.clear();
  for (const Grant& grant : grants)
    if (!grant.refused.empty()) granted = grant.refused;
  return round;
}

Round takt_round(Policy policy, std::string& granted) {
  std::vector<std::unique_ptr<EmptyNode>> nodes;
  Plan plan;
  plan.policy = policy;
  for (int cpu = 0; cpu < std::min(2L, sysconf(_SC_NPROCESSORS_ONLN)); ++cpu) plan.cores.push_back(cpu);
  for (int64_t hz : kRates) {
    nodes.push_back(std::make_unique<EmptyNode>());
    nodes.back()->lateness_us.reserve(64);
    TaskPlan task;
    task.name = std::to_string(hz) + "hz";
    task.node = nodes.back().get();
    task.rate = Rate{hz, 1};
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
  Round round;
  for (const auto& node : nodes) {
    round.lateness_us.add(node->lateness_us);
    round.completed += node->lateness_us.size();
  }
  for (uint64_t released : result.released) round.released += released;
  granted = to_string(result.policy_granted);
  for (const std::string& refused : result.refused) granted += "; " + refused;
  return round;
}

void run_condition(Policy policy, bool loaded, int rounds, std::vector<Row>& rows) {
  const std::string variant = std::string(to_string(policy)) + (loaded ? "_two_hogs" : "_idle");
  std::fprintf(stderr, "release: %s\n", variant.c_str());
  const Hogs hogs(loaded ? 2 : 0);
  Pairs p50, p99;
  Samples all;
  uint64_t released = 0, completed = 0;
  double late = 0, raw_late = 0;  // of as many raw rounds as Takt's: the last raw round is left out
  std::string granted, raw_granted;
  const auto reference = [&] {
    const Round round = raw_round(policy, raw_granted);
    if (p50.rounds() < static_cast<size_t>(rounds)) raw_late += round.over_1ms();
    p50.add_a(round.lateness_us.quantile(0.5).value_or(0));
    p99.add_a(round.lateness_us.quantile(0.99).value_or(0));
  };
  reference();
  for (int i = 0; i < rounds; ++i) {
    const Round round = takt_round(policy, granted);
    p50.add_b(round.lateness_us.quantile(0.5).value_or(0));
    p99.add_b(round.lateness_us.quantile(0.99).value_or(0));
    all.add(round.lateness_us.values());
    late += round.over_1ms();
    released += round.released;
    completed += round.completed;
    reference();
  }
  const std::string name = "clock_nanosleep" + (raw_granted.empty() ? "" : " (" + raw_granted + ")");
  add_pair(rows, {"release/lateness_p50/" + variant, "us", 0, all, {}, {}, {}, granted}, name, p50);
  add_pair(rows, {"release/lateness_p99/" + variant, "us", 0, all, {}, {}, {}, granted}, name, p99);
  rows.push_back({"release/over_1ms/" + variant,
                  "count",
                  late,
                  {},
                  name,
                  raw_late,
                  raw_late > 0 ? std::optional(late / raw_late) : std::nullopt,
                  granted});
  rows.push_back({"release/missed/" + variant,
                  "count",
                  static_cast<double>(released) - static_cast<double>(completed),
                  {},
                  {},
                  {},
                  {},
                  granted});
}

}  // namespace

std::vector<Row> run_release(const Options& options) {
  const int rounds = options.rounds_or(10);
  std::vector<Row> rows;
  for (Policy policy : {Policy::deadline, Policy::fixed})
    for (bool loaded : {false, true}) run_condition(policy, loaded, rounds, rows);
  run_condition(Policy::cooperative, false, rounds, rows);
  return rows;
}

}  // namespace takt::bench
