// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

namespace takt::machine {

/// Distribution of durations, of every sample taken. Plain data.
struct Spread {
  static constexpr int64_t kSamplesForP99 = 100;  ///< with fewer the 99th percentile would be the largest

  double p50_us = 0, p99_us = 0, max_us = 0;
  int64_t samples = 0;
  bool has_p99() const { return samples >= kSamplesForP99; }
  /// What an analysis charges: the 99th percentile, or the largest where there are too few samples for one.
  double charged_us() const { return has_p99() ? p99_us : max_us; }
  /// A quantile is the smallest sample that so many do not exceed.
  static Spread of(std::vector<int64_t> ns);
};

}  // namespace takt::machine
