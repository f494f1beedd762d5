// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <thread>

#include "rt/machine/child.hpp"
#include "rt/machine/facts.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/measure_support.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/rendezvous.hpp"

namespace takt::machine {
namespace {

constexpr size_t kSleepers = 4;
constexpr int64_t kPeriod = 25'000'000, kBudget = 1'000'000, kReleases = 200;
constexpr int kRounds = 20'000, kWarmUp = 1'000;

Reservation sleeper(Policy policy) {
  if (policy == Policy::deadline) return deadline_reservation(kBudget, kPeriod, kPeriod);
  Reservation wanted;
  wanted.policy = policy;
  wanted.priority = 80;
  return wanted;
}

/// Nothing if one of the threads was refused the policy.
std::optional<Spread> lateness_under(Policy policy) {
  std::array<std::vector<int64_t>, kSleepers> late;
  std::array<bool, kSleepers> granted{};
  Rendezvous ready(kSleepers + 1), go(kSleepers + 1);
  std::atomic<int64_t> epoch{0};
  std::vector<std::thread> threads;
  for (size_t i = 0; i < kSleepers; ++i) {
    late[i].reserve(kReleases);
    threads.emplace_back([&, i] {
      prefault_stack();
      granted[i] = apply(sleeper(policy)).policy == policy;
      ready.arrive_and_wait();
      go.arrive_and_wait();
      if (epoch.load() == 0) return;
      const int64_t first = epoch.load() + static_cast<int64_t>(i) * kPeriod / static_cast<int64_t>(kSleepers);
      for (int64_t k = 0; k < kReleases; ++k) {
        sleep_until(first + k * kPeriod);
        late[i].push_back(now_ns() - first - k * kPeriod);
      }
    });
  }
  ready.arrive_and_wait();
  bool all = true;
  for (const bool one : granted) all = all && one;
  if (all) epoch.store(now_ns() + 50'000'000);
  go.arrive_and_wait();
  for (std::thread& thread : threads) thread.join();
  if (!all) return std::nullopt;
  std::vector<int64_t> together;
  for (const auto& one : late) together.insert(together.end(), one.begin(), one.end());
  return Spread::of(std::move(together));
}

ReleaseCost release_cost() {
  prepare_process_memory();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  for (const Policy policy : {Policy::deadline, Policy::fixed})
    if (const auto spread = lateness_under(policy)) return {policy, *spread};
  return {Policy::cooperative, lateness_under(Policy::cooperative).value_or(Spread{})};
}

bool pin_and_raise(int cpu) { return apply(fixed_reservation(80, cpu)).policy == Policy::fixed; }

SwitchCost switch_cost() {
  prepare_process_memory();
  const auto cpus = SystemFacts().allowed_cpus();
  const int cpu = cpus.empty() ? 0 : cpus.back();
  SwitchCost cost;
  std::atomic<uint32_t> ball{0};  // 0: with the first, 1: with the second, 2: the end
  std::atomic<bool> second_fixed{false};
  std::vector<int64_t> one_way;
  one_way.reserve(kRounds);
  std::thread second([&] {
    second_fixed = pin_and_raise(cpu);
    while (true) {
      wait_while(ball, 0);
      if (ball.load() == 2) return;
      set_and_wake(ball, 0);
    }
  });
  std::thread first([&] {
    cost.fixed = pin_and_raise(cpu);
    for (int i = 0; i < kWarmUp + kRounds; ++i) {
      const int64_t begin = now_ns();
      set_and_wake(ball, 1);
      wait_while(ball, 1);
      if (i >= kWarmUp) one_way.push_back((now_ns() - begin) / 2);
    }
    set_and_wake(ball, 2);
  });
  first.join();
  second.join();
  cost.fixed = cost.fixed && second_fixed.load();
  cost.one_way = Spread::of(std::move(one_way));
  return cost;
}

}  // namespace

std::optional<ReleaseCost> measure_release() { return in_child<ReleaseCost>(release_cost, 20'000'000'000); }

std::optional<SwitchCost> measure_switch() { return in_child<SwitchCost>(switch_cost, 20'000'000'000); }

}  // namespace takt::machine
