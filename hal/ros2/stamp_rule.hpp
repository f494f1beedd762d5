// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

namespace takt::ros2 {

/// From the stamp of a message of ROS 2, which counts by the wall clock of the machine that wrote it, to one of this
/// machine's monotonic clock.
struct StampRule {
  /// From the measurement until the message is here, at most, by wall clocks that agree. 0: nobody says that they do;
  /// then a message counts from its arrival, and its age is not known.
  int64_t latency_ns = 0;

  /// Nothing: the stamp lies in the future, or farther back than the latency allows.
  std::optional<int64_t> stamp(int64_t ros_ns, int64_t wall_ns, int64_t monotonic_ns) const {
    if (latency_ns == 0) return monotonic_ns;
    const int64_t age_ns = wall_ns - ros_ns;
    if (age_ns < 0 || age_ns > latency_ns) return std::nullopt;
    return monotonic_ns - age_ns;
  }
};

}  // namespace takt::ros2
