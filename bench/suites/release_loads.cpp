// SPDX-License-Identifier: Apache-2.0
// The whole table of releases: rate x policy x load, beside clock_nanosleep and cyclictest in the same minutes. Rounds
// in turns: Takt, clock_nanosleep, cyclictest (15 Hz), and again; ten minutes in all.
#include <array>
#include <cstdio>

#include "bench/load.hpp"
#include "bench/suite.hpp"
#include "bench/suites/release_rounds.hpp"
#include "rt/memory/process_memory.hpp"

namespace takt::bench {

std::vector<Row> run_release_loads(const Options& options);
std::vector<std::string> release_loads_conditions();

namespace {

constexpr size_t kRates = std::size(kReleaseRates);

struct Variant {
  Policy policy;
  Load load;
  std::string name() const { return std::string(to_string(policy)) + "_" + std::string(to_string(load)); }
};

std::vector<Variant> all_variants() {
  std::vector<Variant> all;
  for (const Policy policy : {Policy::deadline, Policy::fixed, Policy::cooperative})
    for (const Load load : {Load::idle, Load::cpu, Load::memory, Load::disk}) all.push_back({policy, load});
  return all;
}

/// All rounds under one policy and load.
class Condition {
 public:
  explicit Condition(const Variant& variant) : policy_(variant.policy), variant_(variant.name()) {}

  void add_round() {
    const ReleaseRound ours = takt_round(policy_, kDefaultAnticipate_ns, granted_),
                       raw = nanosleep_round(policy_, raw_refused_);
    missed_ += ours.missed;
    raw_missed_ += raw.missed;
    for (size_t rate = 0; rate < kRates; ++rate) {
      takt_[rate].add(ours.lateness_us[rate].values());
      raw_[rate].add(raw.lateness_us[rate].values());
      add(by_rate_[rate], raw.lateness_us[rate], ours.lateness_us[rate], 0.5);
    }
    add(p50_, raw.all(), ours.all(), 0.5);
    add(p99_, raw.all(), ours.all(), 0.99);
    // SCHED_DEADLINE is none of cyclictest's policies; SCHED_FIFO is the nearest.
    const auto theirs = cyclictest_round(policy_ == Policy::deadline ? Policy::fixed : policy_);
    if (!theirs) return;
    cyclictest_.add(theirs->values());
    add(to_cyclictest_[0], *theirs, ours.lateness_us[0], 0.5);
    add(to_cyclictest_[1], *theirs, ours.lateness_us[0], 0.99);
  }

  void report(std::vector<Row>& rows) const {
    const std::string raw = "clock_nanosleep" + (raw_refused_.empty() ? "" : " (" + raw_refused_ + ")");
    Samples all, raw_all;
    for (size_t rate = 0; rate < kRates; ++rate) {
      all.add(takt_[rate].values());
      raw_all.add(raw_[rate].values());
    }
    add_pair(rows, row("p50", all, granted_), raw, p50_);
    add_pair(rows, row("p99", all, granted_), raw, p99_);
    add_pair(rows,
             row("clock_nanosleep", raw_all, raw_refused_.empty() ? std::string(to_string(policy_)) : raw_refused_), "",
             {});
    for (size_t rate = 0; rate < kRates; ++rate)
      add_pair(rows, row(std::to_string(kReleaseRates[rate]) + "hz", takt_[rate], granted_), raw, by_rate_[rate]);
    if (cyclictest_.size() > 0) {
      const std::string name = policy_ == Policy::deadline ? "cyclictest (SCHED_FIFO)" : "cyclictest";
      add_pair(rows, row("15hz_to_cyclictest", takt_[0], granted_), name, to_cyclictest_[0]);
      add_pair(rows, row("15hz_p99_to_cyclictest", takt_[0], granted_), name, to_cyclictest_[1]);
      add_pair(rows, row("cyclictest_15hz", cyclictest_, "not read back"), "", {});
    }
    Row missed = row("missed", {}, granted_);
    missed.unit = "count";
    missed.value = static_cast<double>(missed_);
    missed.reference = raw;
    missed.reference_value = static_cast<double>(raw_missed_);
    rows.push_back(missed);
  }

 private:
  static void add(Pairs& pairs, const Samples& reference, const Samples& ours, double fraction) {
    pairs.add_a(reference.quantile(fraction).value_or(0));
    pairs.add_b(ours.quantile(fraction).value_or(0));
  }
  Row row(const std::string& what, const Samples& samples, const std::string& granted) const {
    return {"release_loads/" + what + "/" + variant_,
            "us",
            samples.quantile(0.5).value_or(0),
            samples,
            {},
            {},
            {},
            granted};
  }

  const Policy policy_;
  const std::string variant_;
  std::array<Samples, kRates> takt_, raw_;
  std::array<Pairs, kRates> by_rate_;
  std::array<Pairs, 2> to_cyclictest_;  // p50, p99
  Pairs p50_, p99_;
  Samples cyclictest_;
  uint64_t missed_ = 0, raw_missed_ = 0;
  std::string granted_, raw_refused_;
};

}  // namespace

std::vector<std::string> release_loads_conditions() {
  std::vector<std::string> names;
  for (const Variant& variant : all_variants()) names.push_back(variant.name());
  return names;
}

std::vector<Row> run_release_loads(const Options& options) {
  const CpuLatencyHold latency = hold_cpu_dma_latency();  // as `takt run` does; cyclictest holds it, too
  if (latency.refused()) std::fprintf(stderr, "release_loads: %s\n", latency.lacks().c_str());
  const int rounds = options.rounds_or(10);
  std::vector<Row> rows;
  if (!cyclictest_round(Policy::cooperative))
    std::fputs("release_loads: cyclictest is not installed; its rows are left out (apt install rt-tests)\n", stderr);
  for (const Variant& variant : all_variants()) {
    if (!options.wants(variant.name())) continue;
    std::fprintf(stderr, "release_loads: %s\n", variant.name().c_str());
    const Burden burden(variant.load);
    Condition condition(variant);
    for (int round = 0; round < rounds; ++round) condition.add_round();
    burden.check();
    condition.report(rows);
  }
  return rows;
}

}  // namespace takt::bench
