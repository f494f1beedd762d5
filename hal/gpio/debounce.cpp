// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/debounce.hpp"

#include <algorithm>

namespace takt {

bool Debounce::observe(bool level, int64_t at_ns) {
  newest_ns_ = std::max(newest_ns_, at_ns);
  const bool before = level_;
  if (!known_) {  // nothing is known of a time before the first look
    known_ = true;
    level_ = level;
    if (level) high_since_ns_ = newest_ns_;
    return false;
  }
  // Before it falls or goes on, a line that was high long enough has counted as high.
  if (high_since_ns_ && newest_ns_ - *high_since_ns_ >= hold_ns_) level_ = true;
  const bool rose = level_ && !before;
  if (!level) {
    high_since_ns_.reset();
    const bool fell = level_;
    level_ = false;
    return rose || fell;
  }
  if (!high_since_ns_) {
    high_since_ns_ = newest_ns_;
    level_ = level_ || hold_ns_ == 0;
  }
  return level_ != before;
}

}  // namespace takt
