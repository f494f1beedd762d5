// SPDX-License-Identifier: Apache-2.0
#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <thread>

#include "rt/machine/check_support.hpp"
#include "rt/machine/child.hpp"
#include "rt/machine/facts.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/measure_support.hpp"
#include "rt/machine/parse.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/bandwidth.hpp"
#include "rt/sched/grant.hpp"

namespace takt::machine {
namespace {

constexpr int64_t kMs = 1'000'000;

struct TickAnswer {
  int64_t tick_ns = 0;
};

TickAnswer least_step() {
  constexpr int64_t kWatched = 400 * kMs;
  TickAnswer answer;
  const int64_t end = now_ns() + kWatched;
  for (int64_t last = read_ns(CLOCK_MONOTONIC_COARSE); now_ns() < end;) {
    const int64_t coarse = read_ns(CLOCK_MONOTONIC_COARSE);
    if (coarse != last && (answer.tick_ns == 0 || coarse - last < answer.tick_ns)) answer.tick_ns = coarse - last;
    last = coarse;
  }
  return answer;
}

BandwidthLimit bandwidth_limit() {
  BandwidthLimit limit;
  for (const DeadlineHolder& holder : deadline_holders()) limit.others += holder.threads;
  limit.accepted = free_bandwidth().value_or(0);
  return limit;
}

int64_t preemptions() {
  rusage use{};
  getrusage(RUSAGE_THREAD, &use);
  return use.ru_nivcsw;
}

/// Spins in bursts, so that a real-time thread leaves something to others.
void watch_cpu(int cpu, int64_t window_ns, Stalls& stalls) {
  constexpr int64_t kBurst = 45 * kMs, kPause = 5 * kMs;
  apply(fixed_reservation(1, cpu));
  for (const int64_t end = now_ns() + window_ns; now_ns() < end;) {
    int64_t before = preemptions();
    const int64_t begin = now_ns();
    for (int64_t last = begin, now = begin; now - begin < kBurst; last = now) {
      now = now_ns();
      if (now - last < Stalls::kShortest_ns) continue;
      const int64_t after = preemptions();
      stalls.add(now - last, after != before);
      before = after;
      now = now_ns();
    }
    stalls.observed_ns += now_ns() - begin;
    sleep_until(now_ns() + kPause);
  }
}

Stalls stalls() {
  constexpr int64_t kWindow = 4'000 * kMs;
  constexpr size_t kMostCpus = 8;
  prepare_process_memory();
  const SystemFacts facts;
  auto cpus = facts.allowed_cpus();
  if (cpus.size() > kMostCpus) cpus.resize(kMostCpus);
  Stalls result;
  const auto before = parse_cpu_times(facts.text("/proc/stat").value_or(""));
  for (const int cpu : cpus)
    std::thread([&] { watch_cpu(cpu, kWindow / static_cast<int64_t>(cpus.size()), result); }).join();
  const auto after = parse_cpu_times(facts.text("/proc/stat").value_or(""));
  if (before && after) result.stolen_ns = (after->steal - before->steal) * (1'000'000'000 / sysconf(_SC_CLK_TCK));
  return result;
}

}  // namespace

void Stalls::add(int64_t hole_ns, bool was_preempted) {
  if (was_preempted) {
    ++preempted;
    preempted_max_ns = std::max(preempted_max_ns, hole_ns);
    return;
  }
  ++count;
  over_1ms += hole_ns > kMs;
  sum_ns += hole_ns;
  max_ns = std::max(max_ns, hole_ns);
}

int64_t bisect_largest(int64_t low, int64_t high, int64_t step, const std::function<bool(int64_t)>& accepts) {
  while (high - low > step) {
    const int64_t middle = low + (high - low) / 2;
    (accepts(middle) ? low : high) = middle;
  }
  return low;
}

std::optional<double> measure_tick() {
  const auto answer = in_child<TickAnswer>(least_step);
  if (!answer || answer->tick_ns == 0) return std::nullopt;
  return static_cast<double>(answer->tick_ns) / 1e3;
}

std::optional<BandwidthLimit> measure_deadline_bandwidth() {
  const auto limit = in_child<BandwidthLimit>(bandwidth_limit);
  return limit && limit->accepted > 0 ? limit : std::nullopt;
}

std::optional<Stalls> measure_stalls() { return in_child<Stalls>(stalls, 20'000'000'000); }

Measured measure_all(const std::function<void(const std::string&)>& tell) {
  Measured result;
  tell("lateness of releases");
  result.release = measure_release();
  tell("context switches");
  result.context_switch = measure_switch();
  tell("publish and take");
  result.local = measure_local_transfers();
  result.iceoryx = measure_iceoryx_transfers();
  tell("enforcement of budgets");
  result.reservation_overrun = measure_reservation_overrun();
  result.watchdog_overrun = measure_watchdog_overrun();
  result.watchdog_look = measure_watchdog_look();
  result.cpu_timer_overrun = measure_cpu_timer_overrun();
  tell("tick and bandwidth");
  result.tick_us = measure_tick();
  result.bandwidth = measure_deadline_bandwidth();
  tell("host stalls");
  result.stalls = measure_stalls();
  return result;
}

}  // namespace takt::machine
