// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/lookout.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>

#include "rt/memory/process_memory.hpp"

namespace takt {
namespace {
constexpr int64_t kYear_ns = 31'536'000'000'000'000;  // instead of never: the arithmetic of timed waits survives it
}  // namespace

Lookout::Lookout(const std::string& name, const Reservation& wanted, const Clock& clock,
                 std::function<int64_t(int64_t)> look)
    : name_(name.substr(0, 15)),
      wanted_(wanted),
      clock_(clock),
      look_(std::move(look)),
      thread_([this] { work(); }, OwnThread::kStack, OwnThread::Stack::resident) {}

Lookout::~Lookout() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Lookout::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

void Lookout::work() {
  pthread_setname_np(pthread_self(), name_.c_str());
  prefault_stack();
  apply(wanted_);
  std::unique_lock lock(mutex_);
  while (!end_) {
    woken_ = false;
    lock.unlock();
    const int64_t now_ns = clock_.now_ns(), next_ns = std::min(look_(now_ns), now_ns + kYear_ns);
    lock.lock();
    // steady_clock is CLOCK_MONOTONIC here, the runtime's own clock.
    const std::chrono::steady_clock::time_point next{std::chrono::nanoseconds(next_ns)};
    changed_.wait_until(lock, next, [&] { return end_ || woken_; });
  }
}

}  // namespace takt
