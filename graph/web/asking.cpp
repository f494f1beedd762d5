// SPDX-License-Identifier: Apache-2.0
#include "graph/web/asking.hpp"

#include <pthread.h>

#include <utility>

namespace takt::web {

Asking::Asking(std::function<Json(const Json&)> answer, std::function<void()> wake)
    : answer_(std::move(answer)), wake_(std::move(wake)), thread_([this] { work(); }, 1 << 20) {}

void Asking::ask(uint64_t session, Json question, Then then) {
  {
    const std::lock_guard lock(mutex_);
    if (asked_.size() < kMostWaiting) {
      asked_.push_back({session, std::move(question), {}, std::move(then)});
      changed_.notify_one();
      return;
    }
  }
  then({{"error", "too many questions wait for an answer"}});
}

void Asking::deliver(const std::function<bool(uint64_t session)>& lives) {
  std::deque<Asked> due;
  {
    const std::lock_guard lock(mutex_);
    due.swap(answered_);
  }
  for (Asked& asked : due)
    if (lives(asked.session)) asked.then(std::move(asked.answer));
}

void Asking::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void Asking::work() {
  pthread_setname_np(pthread_self(), "takt-ask");
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ending_ || !asked_.empty(); });
    if (ending_) return;
    Asked asked = std::move(asked_.front());
    asked_.pop_front();
    lock.unlock();
    asked.answer = answer_(asked.question);
    lock.lock();
    answered_.push_back(std::move(asked));
    lock.unlock();
    wake_();
    lock.lock();
  }
}

}  // namespace takt::web
