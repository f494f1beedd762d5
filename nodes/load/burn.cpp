// SPDX-License-Identifier: Apache-2.0
#include "nodes/load/burn.hpp"

#include "rt/time/clock.hpp"

namespace takt::load {
namespace {

/// Some hundred nanoseconds of arithmetic that the compiler cannot see through: between two readings of the clock most
/// of the time is spent here and not in the kernel.
uint32_t arithmetic(uint32_t x) {
  for (int i = 0; i < 256; ++i) x = x * 1'664'525u + 1'013'904'223u;
  return x;
}

}  // namespace

void burn(int64_t cpu_ns) {
  if (cpu_ns <= 0) return;
  const int64_t until = thread_cpu_ns() + cpu_ns;  // replay: how long it takes is in no message
  volatile uint32_t sink = 1;
  while (thread_cpu_ns() < until) sink = arithmetic(sink);  // replay: as above
}

bool Trouble::due(int64_t release_ns, int64_t every_ns) {
  if (!begun_) {
    begun_ = true;
    last_ns_ = release_ns;
    return false;
  }
  if (every_ns <= 0 || release_ns - last_ns_ < every_ns) return false;
  last_ns_ = release_ns;
  return true;
}

}  // namespace takt::load
