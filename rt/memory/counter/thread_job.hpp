// SPDX-License-Identifier: Apache-2.0
// Shared by the files of takt_allocation_counter: the job of the calling thread.
#pragma once
#include <stddef.h>

#include "rt/memory/job_calls.hpp"
#include "rt/memory/sanitized.hpp"

namespace takt::counter {

// Initial-exec: reading it must not itself allocate, as a lazily made thread-local block would.
extern __attribute__((tls_model("initial-exec"))) thread_local JobCalls* job;

/// Counts the call, or ends the process. Only if `job` is not null.
void note(JobCall call, const char* function);

/// One that any thread may make outside of jobs.
inline void see(JobCall call, const char* function) {
  if (job != nullptr) note(call, function);
}

}  // namespace takt::counter
