// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/web.hpp"

namespace takt {

bool TaskWords::set(std::string_view words) {
  if (words.size() > characters.size()) return false;
  size = words.copy(characters.data(), characters.size());
  return true;
}

bool AnswerLine::put(std::string_view words) {
  if (full_.load(std::memory_order_acquire) || !words_.set(words)) return false;
  full_.store(true, std::memory_order_release);
  return true;
}

bool AnswerLine::take(TaskWords& into) {
  if (!full_.load(std::memory_order_acquire)) return false;
  into.set(words_.text());
  full_.store(false, std::memory_order_release);
  return true;
}

DeviceResult WebScreen::open() {
  open_ = true;
  return {};
}

DeviceResult WebScreen::start(int64_t) {
  started_ = open_;
  return {};
}

void WebScreen::go_on_after(uint32_t number, std::string_view last) {
  number_ = number;
  task_.set(last);
}

bool WebScreen::answer(std::string_view words) {
  if (waits_ || !next_.set(words)) return false;
  waits_ = true;
  return true;
}

InteractionReading WebScreen::read(int64_t wanted_ns) {
  if (!started_) return {};
  if (!waits_ && fingers_) waits_ = fingers_->take(next_);
  if (waits_) {
    waits_ = false;
    task_.set(next_.text());
    ++number_;
    ++received_;
  }
  return {ReadStatus::ok, wanted_ns, number_, task_.text()};
}

}  // namespace takt
