// SPDX-License-Identifier: Apache-2.0
// Lateness of releases: five empty nodes each at 15, 10, 7, 5 and 2 Hz under Takt's executor, against as many threads
// that call clock_nanosleep under the same policy and reservation. Rounds A B A B ... A; idle, and beside two CPU hogs.
// Once as a schedule has it by default, once with workers that sleep until the release itself (`anticipate: 0ms`).
#include <cstdio>
#include <tuple>

#include "bench/load.hpp"
#include "bench/suite.hpp"
#include "bench/suites/release_rounds.hpp"
#include "rt/memory/process_memory.hpp"

namespace takt::bench {

std::vector<Row> run_release(const Options& options);
std::vector<std::string> release_conditions();

namespace {

struct Condition {
  Policy policy;
  Load load;
  int64_t anticipate_ns;
  std::string name() const {
    return std::string(to_string(policy)) + (load == Load::idle ? "_idle" : "_two_hogs") +
           (anticipate_ns == 0 ? "_anticipate_0" : "");
  }
};

std::vector<Condition> all_conditions() {
  std::vector<Condition> all;
  for (const int64_t anticipate_ns : {kDefaultAnticipate_ns, int64_t{0}}) {
    for (const Policy policy : {Policy::deadline, Policy::fixed})
      for (const Load load : {Load::idle, Load::cpu}) all.push_back({policy, load, anticipate_ns});
    all.push_back({Policy::cooperative, Load::idle, anticipate_ns});
  }
  return all;
}

void run_condition(const Condition& condition, int rounds, std::vector<Row>& rows) {
  const Policy policy = condition.policy;
  const std::string variant = condition.name();
  std::fprintf(stderr, "release: %s\n", variant.c_str());
  const Burden burden(condition.load);
  Pairs p50, p99, cpu;
  Samples all, all_cpu;
  // Of as many raw rounds as Takt's: the last raw round is left out.
  double late = 0, raw_late = 0, missed = 0, raw_missed = 0;
  std::string granted, raw_refused;
  const auto reference = [&] {
    const ReleaseRound round = nanosleep_round(policy, raw_refused);
    if (p50.rounds() < static_cast<size_t>(rounds)) {
      raw_late += round.over_1ms();
      raw_missed += static_cast<double>(round.missed);
    }
    p50.add_a(round.all().quantile(0.5).value_or(0));
    p99.add_a(round.all().quantile(0.99).value_or(0));
    cpu.add_a(round.cpu_us);
  };
  reference();
  for (int i = 0; i < rounds; ++i) {
    const ReleaseRound round = takt_round(policy, condition.anticipate_ns, granted);
    p50.add_b(round.all().quantile(0.5).value_or(0));
    p99.add_b(round.all().quantile(0.99).value_or(0));
    cpu.add_b(round.cpu_us);
    all.add(round.all().values());
    all_cpu.add(round.cpu_us);
    late += round.over_1ms();
    missed += static_cast<double>(round.missed);
    reference();
  }
  burden.check();
  const std::string name = "clock_nanosleep" + (raw_refused.empty() ? "" : " (" + raw_refused + ")");
  add_pair(rows, {"release/lateness_p50/" + variant, "us", 0, all, {}, {}, {}, granted}, name, p50);
  add_pair(rows, {"release/lateness_p99/" + variant, "us", 0, all, {}, {}, {}, granted}, name, p99);
  add_pair(rows, {"release/cpu_per_second/" + variant, "us", 0, all_cpu, {}, {}, {}, granted}, name, cpu);
  for (const auto& [what, ours, raw] :
       {std::tuple("over_1ms", late, raw_late), std::tuple("missed", missed, raw_missed)})
    rows.push_back({std::string("release/") + what + "/" + variant,
                    "count",
                    ours,
                    {},
                    name,
                    raw,
                    raw > 0 ? std::optional(ours / raw) : std::nullopt,
                    granted});
}

}  // namespace

std::vector<std::string> release_conditions() {
  std::vector<std::string> names;
  for (const Condition& condition : all_conditions()) names.push_back(condition.name());
  return names;
}

std::vector<Row> run_release(const Options& options) {
  const CpuLatencyHold latency = hold_cpu_dma_latency();  // as `takt run` does; cyclictest holds it, too
  if (latency.refused()) std::fprintf(stderr, "release: %s\n", latency.lacks().c_str());
  const int rounds = options.rounds_or(10);
  std::vector<Row> rows;
  for (const Condition& condition : all_conditions())
    if (options.wants(condition.name())) run_condition(condition, rounds, rows);
  return rows;
}

}  // namespace takt::bench
