// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/web_double.hpp"

namespace takt {

std::span<const Misbehaviour> WebDouble::known() const {
  static constexpr std::array kKnown{Misbehaviour::none, Misbehaviour::silent};
  return kKnown;
}

void WebDouble::run_to(int64_t now_ns) {
  while (pressed_ < script_.size() && epoch_ns_ + script_[pressed_].after_ns <= now_ns) {
    if (how_ != Misbehaviour::silent && !screen_->put(script_[pressed_].task)) return;
    ++pressed_;
  }
}

}  // namespace takt
