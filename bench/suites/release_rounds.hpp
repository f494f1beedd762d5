// SPDX-License-Identifier: Apache-2.0
// A round: empty nodes at 15, 10, 7, 5 and 2 Hz, and what they are measured against. As many at each rate, spread over
// its period, and as long as a p99 needs: 100 samples at 15 Hz in each round, and at 2 Hz in ten of them.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/statistics.hpp"
#include "rt/sched/plan.hpp"

namespace takt::bench {

inline constexpr int64_t kReleaseRates[] = {15, 10, 7, 5, 2};  ///< Hz
inline constexpr size_t kNodesAtEachRate = 5;
inline constexpr int64_t kRoundNs = 1'500'000'000;

struct ReleaseRound {
  std::vector<Samples> lateness_us;  ///< from planned release to start, one entry per rate of kReleaseRates
  uint64_t missed = 0;               ///< jobs that ended after their deadline, the next release, or never ran
  double cpu_us = 0;                 ///< CPU time of the process in a second, from the first release on
  Samples all() const;               ///< of all rates together, us
  double over_1ms() const;           ///< how many of them exceed 1 ms
};

/// Takt's executor, woken up to `anticipate_ns` before a release. `granted`: what the kernel gave, or why not.
ReleaseRound takt_round(Policy policy, int64_t anticipate_ns, std::string& granted);
/// A thread for each node that calls clock_nanosleep, each with the reservation that the executor asks for such a node.
/// `refused`: why one of them did not get it; empty if all did.
ReleaseRound nanosleep_round(Policy policy, std::string& refused);
/// As many threads of cyclictest at 15 Hz under the same policy (fixed or cooperative), us; nothing where it is not
/// installed or fails.
std::optional<Samples> cyclictest_round(Policy policy);

}  // namespace takt::bench
