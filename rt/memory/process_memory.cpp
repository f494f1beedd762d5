// SPDX-License-Identifier: Apache-2.0
#include "rt/memory/process_memory.hpp"

#include <alloca.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include "rt/capability.hpp"

// Defined by takt_allocation_counter where a program links it, null otherwise.
extern "C" __attribute__((weak)) int takt_reserve_heap();

namespace takt {
namespace {

constexpr size_t kPage = 4096;
constexpr size_t kStack = 2 << 20;  // locked whole, for every thread; the default of 8 MB would lock four times as much
constexpr const char* kLatencyFile = "/dev/cpu_dma_latency";

std::string mlock_refused(int reason) {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const std::string allowed =
      limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur / 1024) + " KiB";
  return std::string("mlockall: ") + std::strerror(reason) + " (RLIMIT_MEMLOCK " + allowed +
         "): pages may be swapped out. Fix: ulimit -l unlimited, or 'memlock unlimited' in /etc/security/limits.conf";
}

__attribute__((noinline)) void touch(size_t bytes) {
  auto* block = static_cast<volatile unsigned char*>(alloca(bytes));
  for (size_t i = 0; i < bytes; i += kPage) block[i] = 0;
}

}  // namespace

ProcessMemory prepare_process_memory() {
  ProcessMemory got;
  // The C library's heap; programs that link takt_allocation_counter have another one, set up there.
  // One arena: each further one would be grown, and faulted in, by the first job that allocates on its thread.
  const bool threshold = mallopt(M_MMAP_MAX, 0) == 1;
  const bool trim = mallopt(M_TRIM_THRESHOLD, -1) == 1;
  const bool arenas = mallopt(M_ARENA_MAX, 1) == 1;
  got.malloc = threshold && trim && arenas;
  if (!got.malloc)
    got.lacks.emplace_back(
        "mallopt: refused; this heap cannot be kept from returning pages. Fix: use glibc's malloc (no sanitizer, no "
        "other allocator)");
  if (const int reason = takt_reserve_heap != nullptr ? takt_reserve_heap() : 0; reason != 0) {
    got.malloc = false;
    got.lacks.push_back(std::string("addresses for large blocks: ") + std::strerror(reason) +
                        ": jobs that take them fault pages in. Fix: ulimit -v unlimited");
  }
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) == 0) {
    if (pthread_attr_setstacksize(&attributes, kStack) == 0) pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
  }
  // A limited user would be granted MCL_FUTURE and then fail in every later allocation beyond the limit.
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (!has_capability(CAP_IPC_LOCK) && limit.rlim_cur != RLIM_INFINITY) got.lacks.push_back(mlock_refused(EPERM));
  else if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) got.mlock = true;
  else got.lacks.push_back(mlock_refused(errno));
  return got;
}

size_t stack_left() {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* lowest = nullptr;
  size_t size = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_destroy(&attributes);
  const auto here = reinterpret_cast<uintptr_t>(__builtin_frame_address(0));
  const auto end = reinterpret_cast<uintptr_t>(lowest);
  return here > end ? here - end : 0;
}

size_t prefault_stack(size_t bytes) {
  bytes = std::min(bytes, stack_left() / 2) / kPage * kPage;
  if (bytes > 0) touch(bytes);
  return bytes;
}

CpuLatencyHold::CpuLatencyHold() : file_(open(kLatencyFile, O_WRONLY | O_CLOEXEC)) {
  const int32_t microseconds = 0;
  if (file_ >= 0 && write(file_, &microseconds, sizeof microseconds) == sizeof microseconds) return;
  absent_ = errno == ENOENT;
  lacks_ = std::string(kLatencyFile) + ": " + std::strerror(errno) +
           ": CPUs may sleep deeply between jobs. Fix: run as root, or sudo chmod 666 " + kLatencyFile;
  if (file_ >= 0) close(file_);
  file_ = -1;
}

CpuLatencyHold::CpuLatencyHold(CpuLatencyHold&& other) noexcept
    : file_(std::exchange(other.file_, -1)), absent_(other.absent_), lacks_(std::move(other.lacks_)) {}

CpuLatencyHold::~CpuLatencyHold() {
  if (file_ >= 0) close(file_);
}

CpuLatencyHold hold_cpu_dma_latency() { return {}; }

std::string set_timer_slack() {
  if (prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) != 0 || prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL) != 1)
    return std::string("timer slack: ") + std::strerror(errno) + ": timers may fire up to 50 us late";
  return {};
}

}  // namespace takt
