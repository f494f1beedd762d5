// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

namespace takt {

/// One input as it counts. A fall counts at once, because lines that stop the robot are active-low; a rise when the
/// line has been high for `hold_ns` without a break. Pure; no allocation.
class Debounce {
 public:
  explicit Debounce(int64_t hold_ns = 0) : hold_ns_(hold_ns) {}

  /// The level that the line has from `at_ns` on. Instants that go back count as the newest. True if what counts
  /// changed.
  bool observe(bool level, int64_t at_ns);
  /// What counts.
  bool level() const { return level_; }

 private:
  int64_t hold_ns_, newest_ns_ = INT64_MIN;
  bool level_ = false, known_ = false;
  std::optional<int64_t> high_since_ns_;
};

}  // namespace takt
