// SPDX-License-Identifier: Apache-2.0
#include "nodes/obstacle_stop/stop_state.hpp"

namespace takt::obstacle_stop {

uint32_t FieldState::update(uint32_t reasons, int64_t scan_stamp_ns) {
  if (reasons != 0) {
    held_ |= reasons;
    free_since_ns_.reset();
  } else if (held_ != 0) {
    if (!free_since_ns_) free_since_ns_ = scan_stamp_ns;
    if (scan_stamp_ns - *free_since_ns_ >= release_after_ns_) held_ = 0;
  }
  return held_;
}

void LineState::see(uint32_t levels, uint32_t changed, int64_t now_ns) {
  low_ = (levels >> line_ & 1u) == 0;
  if (low_ || (changed >> line_ & 1u) != 0) held_until_ns_ = now_ns + hold_ns_;
}

}  // namespace takt::obstacle_stop
