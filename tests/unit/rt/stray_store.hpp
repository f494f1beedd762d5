// SPDX-License-Identifier: Apache-2.0
// A store of a process where it may not write, or may.
#pragma once
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <functional>

namespace takt::test {

/// Whether a child that does that ends by SIGSEGV.
inline bool dies_of_a_store(const std::function<void()>& store) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    signal(SIGSEGV, SIG_DFL);
    try {
      store();
    } catch (...) {
      _exit(0);
    }
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV;
}

inline volatile std::byte* bytes_of(const void* at) {
  return const_cast<volatile std::byte*>(static_cast<const std::byte*>(at));
}

}  // namespace takt::test
