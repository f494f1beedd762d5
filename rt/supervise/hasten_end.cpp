// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/hasten_end.hpp"

#include <dirent.h>
#include <sched.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>

#include "rt/sched/grant.hpp"
#include "rt/thread_state.hpp"

namespace takt {
namespace {

void for_each_thread(pid_t process, const std::function<void(int)>& look) {
  std::array<char, 32> folder{};
  std::snprintf(folder.data(), folder.size(), "/proc/%d/task", process);
  const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir(folder.data()), closedir);
  while (const dirent* entry = threads ? readdir(threads.get()) : nullptr)
    if (const int thread = std::atoi(entry->d_name); thread > 0) look(thread);
}

bool is_ordinary(int thread) {
  return (sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK) == SCHED_OTHER && runnable(thread);
}

}  // namespace

bool is_ending(pid_t process) {
  const std::optional<ThreadState> told = thread_state(process);
  return told && told->ending();
}

std::optional<int> signal_of_dead(pid_t process) {
  const std::optional<ThreadState> first = thread_state(process);
  if (!first || !first->ending_by_signal()) return std::nullopt;
  bool all = true;
  for_each_thread(process, [&](int thread) {
    const std::optional<ThreadState> told = thread_state(thread);
    all = all && (!told || told->ending());
  });
  if (!all) return std::nullopt;
  // The kernel looks at the status before it looks at the flags, so only a second answer is sure to have it.
  const std::optional<ThreadState> again = thread_state(process);
  return again && (again->status & 0x7f) != 0 ? again->status & 0x7f : SIGKILL;
}

size_t hasten_end(pid_t process) {
  const std::optional<ThreadState> first = thread_state(process);
  if (!first || !first->ending()) return 0;
  const bool killed = first->ending_by_signal();  // else another thread may go on with its program
  size_t let_go = 0;
  for_each_thread(process, [&](int thread) {
    let_go += take_from_reservation(thread) || (killed && is_ordinary(thread) && lift_thread(thread, kLowestPriority));
  });
  return let_go;
}

}  // namespace takt
