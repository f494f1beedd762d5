// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>

namespace takt {

/// How long somebody has given no sign of life, as far as the one who watches was awake himself: a stall of the whole
/// machine is nobody's silence. Time is given. One thread at a time.
class Silence {
 public:
  /// Heard at `heartbeat_ns` (0: none is expected, which is no silence), looked at now: the silence so far, ns.
  int64_t look(int64_t heartbeat_ns, int64_t now_ns) {
    const int64_t awake_ns = std::min(now_ns - last_look_ns_, kAwakeStep_ns);
    silent_ns_ = heartbeat_ns == 0 || heartbeat_ns != heartbeat_ns_ ? 0 : silent_ns_ + awake_ns;
    heartbeat_ns_ = heartbeat_ns;
    last_look_ns_ = now_ns;
    return silent_ns_;
  }

 private:
  static constexpr int64_t kAwakeStep_ns = 50'000'000;  ///< longer between two looks: the watcher did not run either
  int64_t heartbeat_ns_ = 0, last_look_ns_ = 0, silent_ns_ = 0;
};

}  // namespace takt
