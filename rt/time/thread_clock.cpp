// SPDX-License-Identifier: Apache-2.0
#include "rt/time/thread_clock.hpp"

#include <cstddef>

#include "rt/hot.hpp"
#include "rt/time/clock.hpp"
#if __has_include(<sys/rseq.h>)
#include <sys/rseq.h>
#endif

namespace takt {
namespace {

#ifdef RSEQ_SIG
/// A restartable sequence that no thread is ever in: of its code the kernel reads nothing but the signature in front of
/// the place to restart at. Seeing a thread outside of it, it puts 0 into the thread's area.
constexpr uint32_t kCode[] = {0, RSEQ_SIG, 0};
const struct rseq_cs kNowhere {
  .version = 0, .flags = 0, .start_ip = reinterpret_cast<uintptr_t>(&kCode[0]), .post_commit_offset = 1,
  .abort_ip = reinterpret_cast<uintptr_t>(&kCode[2])
};

/// Where the kernel looks for a sequence of the calling thread. Null: it was not registered.
volatile uint64_t* sequence() {
  if (__rseq_size == 0) return nullptr;
  auto* area = static_cast<char*>(__builtin_thread_pointer()) + __rseq_offset;
  return reinterpret_cast<volatile uint64_t*>(area + offsetof(struct rseq, rseq_cs));
}

void watch_for_others() {
  if (volatile uint64_t* mine = sequence()) *mine = reinterpret_cast<uintptr_t>(&kNowhere);
}
bool undisturbed() {
  volatile uint64_t* mine = sequence();
  return mine != nullptr && *mine == reinterpret_cast<uintptr_t>(&kNowhere);
}
#else
void watch_for_others() {}
bool undisturbed() { return false; }
#endif

struct Reading {
  int64_t cpu_ns = 0;  ///< of the last call, made at at_ns
  int64_t at_ns = 0;
  int64_t told_ns = 0;  ///< the answer to the last question
};
thread_local Reading reading;

}  // namespace

TAKT_HOT int64_t thread_cpu_fast_ns() {
  const MonotonicClock clock;
  const int64_t now_ns = clock.now_ns();
  int64_t cpu_ns = reading.cpu_ns + (now_ns - reading.at_ns);
  // In this order: who loses the CPU between the two is seen.
  if (now_ns - reading.at_ns > kUndisturbed_ns || !undisturbed()) {
    watch_for_others();
    reading.cpu_ns = cpu_ns = thread_cpu_ns();
    reading.at_ns = clock.now_ns();
  }
  // What the host took is in the time, but may not be in the clock: no answer is below the last one for that. In a
  // child that was forked the clock begins anew.
  if (cpu_ns < reading.told_ns && reading.told_ns - cpu_ns <= kUndisturbed_ns) return reading.told_ns;
  return reading.told_ns = cpu_ns;
}

}  // namespace takt
