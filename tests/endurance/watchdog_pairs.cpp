// SPDX-License-Identifier: Apache-2.0
// Whether watching a low node costs a high one its deadline under `fixed`: watchdog_pairs [PAIRS] [SECONDS] [SEED]
// Pairs on one CPU, then two pairs at once on two: at 100 Hz a low node that uses its budget up to 70 us, and a high
// one that preempts it just before; the first pair is a slower one, 10 and 50 ms long. The deadline of the high one is
// the bound that `takt check` proves, and 1 ms. A thread of SCHED_FIFO 98 on each CPU wakes every millisecond: where it
// wakes late, only the host or the kernel had the CPU. A pair beside real-time threads of others shows nothing: it is
// named and run again. Prints a line for each pair. Exit 1 if a high deadline was missed by more than such stalls
// explain, or the watchdogs took 1 % of a core; 77 without the right to SCHED_FIFO, or where others are in the way
// again and again.
#include <dirent.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "graph/check/admission.hpp"
#include "graph/check/check_machine.hpp"
#include "graph/check/figures_file.hpp"
#include "rt/machine/facts.hpp"
#include "rt/machine/measure.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/watch_rules.hpp"
#include "rt/time/units.hpp"

namespace {

using namespace takt;

constexpr int64_t kMs = 1'000'000;
constexpr int kMostDisturbed = 10;

struct Burner final : Node {
  int64_t work_ns = 0;
  void setup(Setup&) override {}
  void run(Job&) override {
    const int64_t until_ns = thread_cpu_ns() + work_ns;
    while (thread_cpu_ns() < until_ns) {
    }
  }
};

struct Hole {
  int64_t from_ns = 0, to_ns = 0;
};

/// Wakes every millisecond before everybody on its CPU.
class Probe {
 public:
  static constexpr int64_t kStep_ns = kMs, kLeast_ns = kMs / 10;
  explicit Probe(int core) : thread_([this, core] { watch(core); }) {}
  ~Probe() {
    end_.store(true);
    thread_.join();
  }
  /// Most time that its CPU may have lost in between.
  int64_t lost_ns(int64_t from_ns, int64_t to_ns) {
    const std::lock_guard lock(mutex_);
    int64_t sum_ns = 0;
    for (const Hole& hole : holes_)
      if (hole.to_ns > from_ns && hole.from_ns < to_ns) sum_ns += hole.to_ns - hole.from_ns;
    return sum_ns;
  }

 private:
  void watch(int core) {
    apply(fixed_reservation(98, core));
    const MonotonicClock clock;
    for (int64_t at_ns = clock.now_ns(); !end_.load();) {
      at_ns += kStep_ns;
      const timespec until{at_ns / 1'000'000'000, at_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      const int64_t now_ns = clock.now_ns();
      if (now_ns - at_ns < kLeast_ns) continue;
      const std::lock_guard lock(mutex_);
      holes_.push_back({at_ns - kStep_ns, now_ns});
      at_ns = now_ns;
    }
  }
  std::mutex mutex_;
  std::vector<Hole> holes_;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

/// Name of another process that has a real-time thread; "": none has. The kernel's own threads do not count.
std::string other_real_time() {
  const std::unique_ptr<DIR, int (*)(DIR*)> processes(opendir("/proc"), closedir);
  while (const dirent* entry = readdir(processes.get())) {
    const int process = std::atoi(entry->d_name);
    const std::string folder = "/proc/" + std::to_string(process);
    if (process <= 0 || process == getpid() || std::ifstream(folder + "/cmdline").get() == EOF) continue;
    const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir((folder + "/task").c_str()), closedir);
    while (const dirent* thread = threads ? readdir(threads.get()) : nullptr) {
      const int policy = sched_getscheduler(std::atoi(thread->d_name)) & ~SCHED_RESET_ON_FORK;
      if (std::atoi(thread->d_name) <= 0 || policy == SCHED_OTHER || policy == SCHED_BATCH || policy == SCHED_IDLE)
        continue;
      std::string name;
      std::getline(std::ifstream(folder + "/comm"), name);
      if (policy >= 0) return name;
    }
  }
  return "";
}

/// CPU time of the threads of this process whose names begin so.
std::map<int, int64_t> cpu_of_watchdogs() {
  std::map<int, int64_t> used;
  const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir("/proc/self/task"), closedir);
  while (const dirent* entry = readdir(threads.get())) {
    std::string name;
    std::getline(std::ifstream(std::string("/proc/self/task/") + entry->d_name + "/comm"), name);
    if (!name.starts_with("watch ") && name != "takt-watchdog") continue;
    const int thread = std::atoi(entry->d_name);
    timespec cpu{};
    const clockid_t clock = (~static_cast<clockid_t>(thread) << 3) | 6;  // its CPU clock, see <linux/posix-timers.h>
    if (clock_gettime(clock, &cpu) == 0) used[thread] = cpu.tv_sec * 1'000'000'000 + cpu.tv_nsec;
  }
  return used;
}

struct Pair {
  int64_t low_ns = 0, high_ns = 0;  ///< CPU time of a job
  int64_t low_budget_ns = 0, high_budget_ns = 0;
  Rate low_rate{100, 1}, high_rate{100, 1};
  int64_t before_ns = 0;  ///< so long before the low job's end the high one comes
};

Pair random_pair(std::mt19937& random) {
  const auto draw = [&](int64_t low, int64_t high) { return std::uniform_int_distribution(low, high)(random); };
  Pair pair;
  pair.low_budget_ns = draw(kMs, 4 * kMs);
  pair.low_ns = pair.low_budget_ns - 70'000;
  pair.high_ns = draw(kMs / 2, 3 * kMs);
  pair.high_budget_ns = pair.high_ns + kMs / 2;
  pair.before_ns = draw(10'000, 500'000);
  return pair;
}

Pair slow_pair() { return {9'930'000, 50 * kMs, 10 * kMs, 52 * kMs, {10, 1}, {10, 1}, 100'000}; }

struct Figures {
  uint64_t jobs = 0, misses = 0, unexplained = 0, low_overruns = 0, demoted = 0;
  int64_t watchdogs_ns = 0, run_ns = 0, error_ns = 0;
  std::string others;  ///< a process with real-time threads that was there meanwhile

  void add(const Figures& more) {
    jobs += more.jobs;
    misses += more.misses;
    unexplained += more.unexplained;
    watchdogs_ns += more.watchdogs_ns;
    run_ns += more.run_ns;
  }
  double share() const { return 100 * static_cast<double>(watchdogs_ns) / static_cast<double>(run_ns); }
};

class Run {
 public:
  Run(const std::vector<Pair>& pairs, const std::vector<int>& cores, const analysis::Overheads& overheads)
      : nodes_(2 * pairs.size()) {
    plan_.policy = Policy::fixed;
    plan_.cores = cores;
    plan_.overheads = overheads;
    for (size_t p = 0; p < pairs.size(); ++p) {
      const Pair& pair = pairs[p];
      nodes_[2 * p].work_ns = pair.low_ns;
      nodes_[2 * p + 1].work_ns = pair.high_ns;
      add(nodes_[2 * p], "low", pair.low_rate, pair.low_budget_ns, 0, cores[p]);
      add(nodes_[2 * p + 1], "high", pair.high_rate, pair.high_budget_ns, pair.low_ns - pair.before_ns, cores[p]);
      plan_.tasks.back().criticality = Criticality::high;
    }
  }

  /// Deadlines of the high ones: what is proven, and as much as a stall may last that no probe sees. False: not
  /// admitted.
  bool set_deadlines() {
    const graph::Admission admission = graph::admit(plan_, plan_.overheads);
    if (admission.answer != graph::Answer::admitted) return false;
    for (size_t t = 1; t < plan_.tasks.size(); t += 2)
      plan_.tasks[t].deadline_ns =
          std::min(plan_.tasks[t].deadline_ns, *admission.nodes[t].response_ns + Probe::kStep_ns);
    return true;
  }
  double deadline_ms(size_t pair) const { return to_ms(plan_.tasks[2 * pair + 1].deadline_ns); }

  Figures run(int64_t duration_ns, std::vector<std::unique_ptr<Probe>>& probes) {
    RunBoard board(plan_);
    const auto transport = make_local_transport(plan_.ports);
    MonotonicClock clock;
    Executor::Options options;
    options.duration_ns = duration_ns;
    options.board = &board;
    options.require_policy = true;
    Executor executor(plan_, *transport, clock, options);
    std::atomic<bool> ended{false};
    std::thread runner([&] {
      executor.run();
      ended.store(true);
    });
    std::vector<uint64_t> seen(plan_.tasks.size(), 0);
    std::map<int, int64_t> watchdogs;
    while (!ended.load()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      for (const auto& [thread, cpu_ns] : cpu_of_watchdogs()) watchdogs[thread] = cpu_ns;
      if (figures_.others.empty()) figures_.others = other_real_time();
      look_at_jobs(board, seen, probes);
    }
    runner.join();
    look_at_jobs(board, seen, probes);
    figures_.run_ns = duration_ns;
    for (const auto& [thread, cpu_ns] : watchdogs) figures_.watchdogs_ns += cpu_ns;
    for (size_t t = 0; t < plan_.tasks.size(); t += 2) {
      figures_.low_overruns += board.task(t).budget_overruns.load();
      figures_.demoted += board.task(t).demoted.load();
      figures_.error_ns = std::max(figures_.error_ns, board.task(t).enforcement_error_ns.load());
      figures_.jobs += board.task(t + 1).job_count.load();
    }
    return figures_;
  }

 private:
  void add(Node& node, const char* name, Rate rate, int64_t budget_ns, int64_t offset_ns, int core) {
    TaskPlan task;
    task.name = name + std::to_string(core);
    task.node = &node;
    task.rate = rate;
    task.budget_ns = budget_ns;
    task.deadline_ns = rate.period_ns();
    task.offset_ns = offset_ns;
    task.core = core;
    plan_.tasks.push_back(task);
  }

  void look_at_jobs(RunBoard& board, std::vector<uint64_t>& seen, std::vector<std::unique_ptr<Probe>>& probes) {
    for (size_t t = 1; t < plan_.tasks.size(); t += 2) {
      const TaskStatistics& statistics = board.task(t);
      for (const uint64_t n = statistics.job_count.load(); seen[t] < n; ++seen[t]) {
        const JobRecord& job = statistics.jobs[seen[t] % statistics.jobs.size()];
        const int64_t over_ns = job.finish_ns - job.release_ns - plan_.tasks[t].deadline_ns;
        if (over_ns <= 0) continue;
        ++figures_.misses;
        // A stall may have hit the jobs before, which this one waited for.
        const int64_t from_ns = job.release_ns - plan_.tasks[t].rate->period_ns();
        if (probes[t / 2]->lost_ns(from_ns, job.finish_ns) < over_ns) {
          ++figures_.unexplained;
          std::printf("  %s: %.3f ms late, and its CPU stood still for no more than %.3f ms\n",
                      plan_.tasks[t].name.c_str(), to_ms(over_ns),
                      to_ms(probes[t / 2]->lost_ns(from_ns, job.finish_ns)));
        }
      }
    }
  }

  std::vector<Burner> nodes_;
  Plan plan_;
  Figures figures_;
};

void print(const Pair& pair, double deadline_ms, size_t cores, const Figures& figures) {
  std::printf(
      "%zu CPU%s: low %.2f of %.2f ms, high %.2f of %.2f within %.2f ms: %lu jobs, %lu misses, %lu unexplained; "
      "watchdogs %.2f %% of a core; %lu demoted, %.3f ms late at most%s%s\n",
      cores, cores == 1 ? " " : "s", to_ms(pair.low_ns), to_ms(pair.low_budget_ns), to_ms(pair.high_ns),
      to_ms(pair.high_budget_ns), deadline_ms, figures.jobs, figures.misses, figures.unexplained, figures.share(),
      figures.demoted, to_ms(figures.error_ns), figures.others.empty() ? "" : "; not judged beside ",
      figures.others.c_str());
  std::fflush(stdout);
}

/// With pairs that are admitted; null if there are none.
std::unique_ptr<Run> admitted_run(bool slow, const std::vector<int>& cores, const analysis::Overheads& overheads,
                                  std::mt19937& random, std::vector<Pair>& drawn) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    drawn.clear();
    for (size_t p = 0; p < cores.size(); ++p) drawn.push_back(slow ? slow_pair() : random_pair(random));
    auto run = std::make_unique<Run>(drawn, cores, overheads);
    if (run->set_deadlines()) return run;
  }
  std::puts("no pair is admitted with the overheads of this machine");
  return nullptr;
}

/// Of the file that `takt doctor --measure` left, or assumed; what the watchdog costs is measured here.
analysis::Overheads overheads_here(const machine::Facts& facts) {
  analysis::Overheads overheads = graph::check_machine(facts, graph::figures_file()).overheads;
  const auto ns = [](double us) { return static_cast<int64_t>(us * 1e3); };
  if (const auto overrun = machine::measure_watchdog_overrun()) overheads.demotion_ns = ns(overrun->max_us);
  if (const auto look = machine::measure_watchdog_look()) {
    overheads.look_ns = ns(look->p50_us);
    std::printf("a look: p50 %.1f, p99 %.1f, max %.1f us; a budget is exceeded by %.3f ms at most\n", look->p50_us,
                look->p99_us, look->max_us, to_ms(overheads.demotion_ns + kWatchGrain_ns));
  }
  return overheads;
}

}  // namespace

int main(int argc, char** argv) {
  const int pairs = argc > 1 ? std::atoi(argv[1]) : 20;
  const int64_t duration_ns = (argc > 2 ? std::atoi(argv[2]) : 5) * 1'000 * kMs;
  std::mt19937 random(argc > 3 ? static_cast<uint32_t>(std::atoi(argv[3])) : 36);
  const machine::SystemFacts facts;
  const analysis::Overheads overheads = overheads_here(facts);  // forks: before there are threads
  prepare_process_memory();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  const Reservation above = fixed_reservation(kHighestPriority + 1);
  if (bool granted = false; std::thread([&] { granted = apply(above).verified; }).join(), !granted) {
    std::puts("NOT RUN: SCHED_FIFO is refused to this user");
    return 77;
  }
  const std::vector<int> cpus = facts.allowed_cpus();
  bool good = true;
  for (const size_t cores : {size_t{1}, size_t{2}}) {
    if (cores > cpus.size()) continue;
    const std::vector<int> cores_used(cpus.begin(), cpus.begin() + static_cast<ptrdiff_t>(cores));
    Figures all;
    for (int done = 0, disturbed = 0; done < pairs;) {
      std::vector<Pair> drawn;
      const std::unique_ptr<Run> run = admitted_run(done == 0, cores_used, overheads, random, drawn);
      if (run == nullptr) return 1;
      std::vector<std::unique_ptr<Probe>> probes;
      for (const int core : cores_used) probes.push_back(std::make_unique<Probe>(core));
      const Figures figures = run->run(duration_ns, probes);
      print(drawn.front(), run->deadline_ms(0), cores, figures);
      if (figures.others.empty()) {
        all.add(figures);
        ++done;
      } else if (++disturbed > pairs + kMostDisturbed) {
        std::puts("NOT RUN: others have real-time threads here");
        return 77;
      }
    }
    std::printf("%zu CPU%s together: %lu jobs, %lu misses, %lu unexplained; watchdogs %.2f %% of a core\n", cores,
                cores == 1 ? " " : "s", all.jobs, all.misses, all.unexplained, all.share());
    good = good && all.unexplained == 0 && all.share() < 1;
  }
  return good ? 0 : 1;
}
