// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace takt::test {

/// The threads of this process, by name (15 characters at most).
inline std::map<std::string, pid_t> own_threads() {
  std::map<std::string, pid_t> threads;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(thread.path() / "comm"), name);
    threads[name] = std::stoi(thread.path().filename());
  }
  return threads;
}

}  // namespace takt::test
