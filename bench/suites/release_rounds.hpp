// SPDX-License-Identifier: Apache-2.0
// One second of five empty nodes at 15, 10, 7, 5 and 2 Hz, and of what they are measured against.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/statistics.hpp"
#include "rt/sched/plan.hpp"

namespace takt::bench {

inline constexpr int64_t kReleaseRates[] = {15, 10, 7, 5, 2};

struct ReleaseRound {
  std::vector<Samples> lateness_us;  ///< per rate
  uint64_t released = 0, completed = 0;
  Samples all() const;
  double over_1ms() const;
};

/// Takt's executor. `granted`: what the kernel gave, or why not.
ReleaseRound takt_round(Policy policy, std::string& granted);
/// A thread per rate that calls clock_nanosleep, each with the reservation that the executor asks for such a node.
ReleaseRound nanosleep_round(Policy policy, std::string& refused);
/// cyclictest at 15 Hz under the same policy (fixed or cooperative); nothing where it is not installed.
std::optional<Samples> cyclictest_round(Policy policy);

}  // namespace takt::bench
