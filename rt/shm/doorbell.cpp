// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/doorbell.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <climits>
#include <ctime>

namespace takt {

void Doorbell::ring() {
  rung_.fetch_add(1, std::memory_order_release);
  syscall(SYS_futex, &rung_, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

void Doorbell::wait(uint32_t heard, int64_t at_most_ns) const {
  if (at_most_ns <= 0) return;
  const timespec patience{at_most_ns / 1'000'000'000, at_most_ns % 1'000'000'000};
  syscall(SYS_futex, &rung_, FUTEX_WAIT, heard, &patience, nullptr, 0);
}

}  // namespace takt
