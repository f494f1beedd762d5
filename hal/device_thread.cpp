// SPDX-License-Identifier: Apache-2.0
#include "hal/device_thread.hpp"

#include <linux/sched.h>
#include <pthread.h>
#include <sched.h>

namespace takt {
namespace {

bool in_real_time() {
  const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return policy == SCHED_FIFO || policy == SCHED_DEADLINE;
}

}  // namespace

bool LeavesTime::at(int64_t now_ns, int64_t used_ns) {
  constexpr int64_t kWindow_ns = 200'000'000;
  constexpr double kMost = 0.8, kEnough = 0.5;
  if (from_ns_ != INT64_MIN) {
    if (now_ns - from_ns_ < kWindow_ns) return leaves_;
    const double share = static_cast<double>(used_ns - used_before_ns_) / static_cast<double>(now_ns - from_ns_);
    leaves_ = share < (leaves_ ? kMost : kEnough);
  }
  from_ns_ = now_ns;
  used_before_ns_ = used_ns;
  return leaves_;
}

void DevicePriority::follow() {
  if (!wanted_.load(std::memory_order_relaxed) && in_real_time()) wanted_.store(true, std::memory_order_relaxed);
}

void DevicePriority::keep(const Clock& clock) {
  const bool leaves = leaves_time_.at(clock.now_ns(), thread_cpu_ns());
  take(leaves && wanted_.load(std::memory_order_relaxed) ? Has::real_time : Has::ordinary);
}

void DevicePriority::take(Has what) {
  if (has_ == what) return;
  has_ = what;
  sched_param priority{};
  if (what == Has::real_time) priority.sched_priority = sched_get_priority_min(SCHED_FIFO);
  pthread_setschedparam(pthread_self(), what == Has::real_time ? SCHED_FIFO : SCHED_OTHER, &priority);
}

}  // namespace takt
