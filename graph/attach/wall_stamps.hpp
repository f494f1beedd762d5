// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <cstdint>
#include <cstdlib>

namespace takt::attach {

/// Since 1970.
inline int64_t wall_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Stamps of a run (CLOCK_MONOTONIC) as other programs count, ROS 2 and Foxglove: since 1970. Equal stamps stay equal:
/// the offset is that of the first call until the wall clock has moved by kStep_ns against it.
class WallStamps {
 public:
  static constexpr int64_t kStep_ns = 1'000'000;
  /// Both clocks at one instant. True: what is given from now on lies elsewhere.
  bool look(int64_t wall_ns, int64_t monotonic_ns) {
    const int64_t offset_ns = wall_ns - monotonic_ns;
    if (known_ && std::abs(offset_ns - offset_ns_) <= kStep_ns) return false;
    offset_ns_ = offset_ns;
    known_ = true;
    return true;
  }
  int64_t of(int64_t monotonic_ns) const { return monotonic_ns + offset_ns_; }

 private:
  int64_t offset_ns_ = 0;
  bool known_ = false;
};

}  // namespace takt::attach
