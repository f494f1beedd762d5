// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/hasten_end.hpp"

#include <dirent.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "rt/sched/grant.hpp"
#include "rt/thread_state.hpp"

namespace takt {

bool is_ending(pid_t process) {
  const std::optional<ThreadState> told = thread_state(process);
  return told && told->ending();
}

size_t hasten_end(pid_t process) {
  if (!is_ending(process)) return 0;
  std::array<char, 32> folder{};
  std::snprintf(folder.data(), folder.size(), "/proc/%d/task", process);
  const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir(folder.data()), closedir);
  size_t let_go = 0;
  while (const dirent* entry = threads ? readdir(threads.get()) : nullptr)
    if (const int thread = std::atoi(entry->d_name); thread > 0) let_go += take_from_reservation(thread);
  return let_go;
}

}  // namespace takt
