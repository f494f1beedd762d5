// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/job_calls.hpp>: core, stable.
// Calls that no job should make: they block, allocate or enter the kernel for longer than anybody can say. They are
// seen where a program links takt_allocation_counter (see there), by taking the place of the C library's functions.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

namespace takt {

enum class JobCall : uint8_t {
  malloc,  ///< and its kin; free is none
  mmap,    ///< mmap, munmap, brk
  file,    ///< open, read, write, close and their kin
  stdio,   ///< printf, puts, fwrite, fflush: locks and writes
  socket,  ///< socket, connect, accept, send, receive and their kin
  thread,  ///< pthread_create
  sleep,   ///< nanosleep and its kin, sched_yield
  lock,    ///< pthread_mutex_lock that would block; one that gets the mutex at once is none
  wait,    ///< condition variables, semaphores, poll, pthread_join
};
constexpr size_t kJobCalls = 9;
std::string_view to_string(JobCall call);

constexpr uint32_t bit(JobCall call) { return 1u << static_cast<uint32_t>(call); }

/// What is watched while a thread is in a job. One per task, used by the thread that runs it.
struct JobCalls {
  const char* node = "";
  uint64_t job = 0;
  uint64_t* counts = nullptr;  ///< kJobCalls of them
  uint32_t allowed = 0;        ///< bits of calls that the node declares: not counted
  bool warm = false;           ///< the first jobs may set things up: nothing counted yet
  bool strict = false;         ///< the first call that is counted ends the process, with its name
  int64_t heap_bytes = 0;      ///< what the node's jobs took and did not give back
  int64_t heap_limit = INT64_MAX;
  int64_t heap_refused = 0;  ///< bytes that a job asked for beyond the limit, and did not get
};

/// While it lives, calls of the calling thread are those of this job. Costs a store, without the counter nothing.
class JobScope {
 public:
  explicit JobScope(JobCalls& calls);
  ~JobScope();
  JobScope(const JobScope&) = delete;
  JobScope& operator=(const JobScope&) = delete;
};

/// True if this program sees such calls.
bool watching_job_calls();

/// True if the environment asks for an end of the process at the first of them: TAKT_RT_STRICT=1.
bool strict_job_calls();

}  // namespace takt
