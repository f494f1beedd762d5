// SPDX-License-Identifier: Apache-2.0
#include "hal/device_thread.hpp"

#include <linux/sched.h>
#include <pthread.h>
#include <sched.h>

namespace takt {

bool in_real_time() {
  const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return policy == SCHED_FIFO || policy == SCHED_DEADLINE;
}

void take_priority(bool real_time) {
  sched_param wanted{};
  if (real_time) wanted.sched_priority = sched_get_priority_min(SCHED_FIFO);
  pthread_setschedparam(pthread_self(), real_time ? SCHED_FIFO : SCHED_OTHER, &wanted);
}

}  // namespace takt
