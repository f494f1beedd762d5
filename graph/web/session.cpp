// SPDX-License-Identifier: Apache-2.0
#include "graph/web/session.hpp"

#include <utility>

namespace takt::web {

void Session::send(Frame frame, bool binary) {
  waiting_bytes_ += frame->size();
  waiting_.push_back({std::move(frame), binary});
  while (waiting_bytes_ > kMostWaiting && waiting_.size() > 1) {
    waiting_bytes_ -= waiting_.front().frame->size();
    waiting_.pop_front();
    ++dropped_;
  }
}

std::optional<Session::Message> Session::next() {
  if (waiting_.empty() && dropped_ > 0) tell_dropped(std::exchange(dropped_, 0));
  if (waiting_.empty()) return next_shown();
  Message message = std::move(waiting_.front());
  waiting_bytes_ -= message.frame->size();
  waiting_.pop_front();
  return message;
}

}  // namespace takt::web
