// SPDX-License-Identifier: Apache-2.0
// What was seen above its proof: plain data in the memory that the processes of a run share. A sample within its bound
// costs one comparison.
#pragma once
#include <optional>

#include "rt/sched/append_log.hpp"

namespace takt {

/// A sample above what was proven of its figure.
struct Excess {
  enum Figure : uint32_t {
    response,    ///< of task `index`
    input_age,   ///< of edge `edge` of task `index`, at the start of a job
    output_age,  ///< of port `index`, at the instant from which consumers may see the message
  };
  Figure figure = response;
  uint32_t index = 0, edge = 0;
  int64_t at_ns = 0;        ///< end of the response; instant at which the age was taken
  int64_t observed_ns = 0;  ///< so it began at `at_ns - observed_ns`
};

/// A job that used more than its budget, which no proof allows for.
struct Overrun {
  uint32_t task = 0;
  int64_t release_ns = 0, finish_ns = 0;
};

/// The source of a task was late, which no proof allows for (Job::source_late()).
struct LateSource {
  static constexpr int64_t kShortest_ns = 500'000;
  uint32_t task = 0;
  int64_t at_ns = 0;    ///< end of the job that was told
  int64_t late_ns = 0;  ///< since the job before
};

inline constexpr size_t kMostExcesses = 2048, kMostOverruns = 1024, kMostLateSources = 4096;
using ExcessLog = AppendLog<Excess, kMostExcesses>;
using OverrunLog = AppendLog<Overrun, kMostOverruns>;
using LateSourceLog = AppendLog<LateSource, kMostLateSources>;

/// Upper bound of one figure, and its samples above that. One thread compares; anybody reads.
class ProofBound {
 public:
  /// Of the first ones above the bound, so many are logged; afterwards those larger than all before.
  static constexpr uint64_t kLogged = 32;

  /// Before the first job. Without a bound nothing is above it.
  void set(int64_t bound_ns) { bound_ns_.store(bound_ns); }
  void compare(const Excess& sample, ExcessLog& log) {
    if (sample.observed_ns > bound_ns_.load(std::memory_order_relaxed)) note(sample, log);
  }
  uint64_t above() const { return above_.load(); }
  /// Nothing: none is set.
  std::optional<int64_t> bound_ns() const {
    const int64_t bound_ns = bound_ns_.load(std::memory_order_relaxed);
    return bound_ns < INT64_MAX ? std::optional(bound_ns) : std::nullopt;
  }

 private:
  void note(const Excess& sample, ExcessLog& log) {
    const uint64_t before = above_.load(std::memory_order_relaxed);
    above_.store(before + 1, std::memory_order_relaxed);
    if (before < kLogged || sample.observed_ns > largest_ns_) log.append(sample);
    largest_ns_ = std::max(largest_ns_, sample.observed_ns);
  }

  std::atomic<int64_t> bound_ns_{INT64_MAX};
  std::atomic<uint64_t> above_{0};
  int64_t largest_ns_ = 0;
};

}  // namespace takt
