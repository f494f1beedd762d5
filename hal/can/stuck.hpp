// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

namespace takt::can {

/// Tells what says that it lives and does not move, although it has to. One thread.
class Stuck {
 public:
  static constexpr int64_t kAfter_ns = 500'000'000;

  void observe(bool has_to_move, bool moved, int64_t now_ns) {
    if (!has_to_move || moved) since_ns_.reset();
    else if (!since_ns_) since_ns_ = now_ns;
    stuck_ = since_ns_ && now_ns - *since_ns_ >= kAfter_ns;
  }
  void forget() { *this = {}; }
  bool stuck() const { return stuck_; }

 private:
  std::optional<int64_t> since_ns_;
  bool stuck_ = false;
};

}  // namespace takt::can
