// SPDX-License-Identifier: Apache-2.0
#include "rt/memory/job_calls.hpp"

#include <cstdlib>
#include <cstring>

#include "rt/hot.hpp"

// Where the calling thread's job is noted; defined by takt_allocation_counter where a program links it, null otherwise.
extern "C" __attribute__((weak)) takt::JobCalls** takt_thread_job_calls();

namespace takt {

std::string_view to_string(JobCall call) {
  constexpr std::array<std::string_view, kJobCalls> names{"malloc", "mmap",  "file", "stdio", "socket",
                                                          "thread", "sleep", "lock", "wait"};
  return names[static_cast<size_t>(call)];
}

TAKT_HOT JobScope::JobScope(JobCalls& calls) {
  if (takt_thread_job_calls != nullptr) *takt_thread_job_calls() = &calls;
}

TAKT_HOT JobScope::~JobScope() {
  if (takt_thread_job_calls != nullptr) *takt_thread_job_calls() = nullptr;
}

bool watching_job_calls() { return takt_thread_job_calls != nullptr; }

bool strict_job_calls() {
  const char* asked = std::getenv("TAKT_RT_STRICT");
  return asked != nullptr && std::strcmp(asked, "1") == 0;
}

}  // namespace takt
