// SPDX-License-Identifier: Apache-2.0
#include "rt/thread_state.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace takt {

std::optional<ThreadState> thread_state(pid_t thread) {
  std::array<char, 1024> text{};
  // /proc/PID/stat would sum up all threads of the process, which takes ten times as long.
  std::snprintf(text.data(), text.size(), "/proc/%d/task/%d/stat", thread, thread);
  const int file = open(text.data(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  const ssize_t got = read(file, text.data(), text.size() - 1);
  close(file);
  if (got <= 0) return std::nullopt;
  text[static_cast<size_t>(got)] = 0;
  // "TID (NAME) STATE ...", and a name may have brackets of its own.
  const char* name_end = std::strrchr(text.data(), ')');
  ThreadState told;
  if (name_end == nullptr || std::sscanf(name_end, ") %c %*d %*d %*d %*d %*d %u", &told.state, &told.flags) != 2)
    return std::nullopt;
  told.status = std::atoi(std::strrchr(name_end, ' '));  // the last field
  return told;
}

}  // namespace takt
