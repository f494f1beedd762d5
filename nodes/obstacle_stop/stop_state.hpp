// SPDX-License-Identifier: Apache-2.0
// What a stop remembers from job to job. Instants in ns of the graph's clock; no allocation; one thread at a time.
#pragma once
#include <cstdint>
#include <optional>

#include "rt/state_archive.hpp"

namespace takt::obstacle_stop {

/// Hysteresis of the protected field: a reason to stop stays in force until the field has been seen free for
/// `release_after_ns`, by the scans' own stamps. Begins stopped with `initial`, as nothing has been seen yet.
class FieldState {
 public:
  FieldState(uint32_t initial, int64_t release_after_ns) : held_(initial), release_after_ns_(release_after_ns) {}
  void tune(int64_t release_after_ns) { release_after_ns_ = release_after_ns; }
  /// `reasons` of this job (bits of stop_reason; 0: the scan shows a free field); returns those in force.
  uint32_t update(uint32_t reasons, int64_t scan_stamp_ns);
  void remember(StateArchive& archive) { TAKT_STATE(archive, held_, free_since_ns_); }

 private:
  uint32_t held_;
  int64_t release_after_ns_;
  std::optional<int64_t> free_since_ns_;
};

/// The emergency-stop line, active-low (level 0 stops: a broken wire does, too). A stop lasts until `hold_ns` after
/// the last sign of it, so that a pulse between two reads stops as well.
class LineState {
 public:
  LineState(uint32_t line, int64_t hold_ns) : line_(line), hold_ns_(hold_ns) {}
  /// A stop in force lasts as long as it would have; of another line its next reading tells.
  void tune(uint32_t line, int64_t hold_ns) { line_ = line, hold_ns_ = hold_ns; }
  /// One reading that was not seen before; bits as in DigitalState.
  void see(uint32_t levels, uint32_t changed, int64_t now_ns);
  bool stops(int64_t now_ns) const { return low_ || (held_until_ns_ && now_ns < *held_until_ns_); }
  void remember(StateArchive& archive) { TAKT_STATE(archive, low_, held_until_ns_); }

 private:
  uint32_t line_;
  int64_t hold_ns_;
  bool low_ = false;
  std::optional<int64_t> held_until_ns_;
};

}  // namespace takt::obstacle_stop
