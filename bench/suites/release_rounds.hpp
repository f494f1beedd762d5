// SPDX-License-Identifier: Apache-2.0
// One second of five empty nodes at 15, 10, 7, 5 and 2 Hz, and of what they are measured against.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/statistics.hpp"
#include "rt/sched/plan.hpp"

namespace takt::bench {

inline constexpr int64_t kReleaseRates[] = {15, 10, 7, 5, 2};  ///< Hz

struct ReleaseRound {
  std::vector<Samples> lateness_us;      ///< from planned release to start, one entry per rate of kReleaseRates
  uint64_t released = 0, completed = 0;  ///< jobs of all rates; 0 where no executor counts them
  double cpu_us = 0;                     ///< CPU time of the process in the second from the first release on
  Samples all() const;                   ///< of all rates together, us
  double over_1ms() const;               ///< how many of them exceed 1 ms
};

/// Takt's executor, woken up to `anticipate_ns` before a release. `granted`: what the kernel gave, or why not.
ReleaseRound takt_round(Policy policy, int64_t anticipate_ns, std::string& granted);
/// A thread per rate that calls clock_nanosleep, each with the reservation that the executor asks for such a node.
/// `refused`: why one of them did not get it; empty if all did.
ReleaseRound nanosleep_round(Policy policy, std::string& refused);
/// cyclictest at 15 Hz under the same policy (fixed or cooperative), us; nothing where it is not installed or fails.
std::optional<Samples> cyclictest_round(Policy policy);

}  // namespace takt::bench
