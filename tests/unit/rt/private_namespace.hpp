// SPDX-License-Identifier: Apache-2.0
// There can be one iceoryx daemon on a machine. Tests therefore see a /tmp and a /dev/shm of their own.
#pragma once
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

namespace takt::test {

/// Moves this process (once) to a mount namespace with an empty /tmp and /dev/shm. False, and said on stderr, where it
/// may not: the caller then returns.
inline bool private_tmp_and_shm() {
  static const bool done = [] {
    if (std::getenv("TAKT_IN_PRIVATE_NAMESPACE") != nullptr) return true;  // started by a test that moved
    if (unshare(CLONE_NEWNS) == 0 && mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
        mount("tmpfs", "/tmp", "tmpfs", 0, nullptr) == 0 && mount("tmpfs", "/dev/shm", "tmpfs", 0, nullptr) == 0)
      return setenv("TAKT_IN_PRIVATE_NAMESPACE", "1", 1) == 0;
    std::cerr << "NOT RUN: tests of the iceoryx transport need a private mount namespace: " << std::strerror(errno)
              << "; run them as root\n";
    return false;
  }();
  return done;
}

inline std::vector<std::string> files_left() {
  std::vector<std::string> left;
  for (const char* directory : {"/tmp", "/dev/shm"})
    for (const auto& entry : std::filesystem::directory_iterator(directory)) left.push_back(entry.path());
  return left;
}

}  // namespace takt::test
