// SPDX-License-Identifier: Apache-2.0
#include "bench/load.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>

#include "bench/suite.hpp"

namespace takt::bench {
namespace {

constexpr size_t kCopied = 64 << 20, kWritten = 16 << 20;

[[noreturn]] void spin() {
  for (volatile uint64_t n = 0;;) n = n + 1;
}

[[noreturn]] void copy() {
  std::vector<char> one(kCopied, 1), other(kCopied);
  for (;;) {
    std::memcpy(other.data(), one.data(), kCopied);
    std::memcpy(one.data(), other.data(), kCopied);
  }
}

[[noreturn]] void write_and_sync() {
  char name[] = "takt-bench-XXXXXX";
  const int file = mkstemp(name);
  unlink(name);
  const std::vector<char> block(kWritten, 1);
  while (file >= 0 && pwrite(file, block.data(), block.size(), 0) == static_cast<ssize_t>(block.size()) &&
         fdatasync(file) == 0) {
  }
  _exit(1);
}

/// noexcept: a child that runs out of memory must end here, and not go on with what its parent does.
[[noreturn]] void run(Load load) noexcept {
  if (load == Load::memory) copy();
  if (load == Load::disk) write_and_sync();
  spin();
}

}  // namespace

std::string_view to_string(Load load) {
  switch (load) {
    case Load::idle: return "idle";
    case Load::cpu: return "cpu";
    case Load::memory: return "memory";
    case Load::disk: return "disk";
  }
  return "";
}

Burden::Burden(Load load) {
  for (int i = 0; i < 2 && load != Load::idle; ++i) {
    const pid_t pid = fork();
    if (pid < 0) {
      end();
      throw CannotRun("fork failed");
    }
    if (pid == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      run(load);
    }
    pids_.push_back(pid);
  }
}

void Burden::check() const {
  for (const pid_t pid : pids_) {
    // Not reaped here: until the end of this object the id must not become that of somebody else's process.
    siginfo_t ended{};
    if (waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid != 0)
      throw CannotRun("a load process ended; is there memory, and is the current folder writable?");
  }
}

Burden::~Burden() { end(); }

void Burden::end() {
  for (const pid_t pid : pids_) {
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
  }
}

}  // namespace takt::bench
