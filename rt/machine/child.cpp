// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/child.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace takt::machine::detail {
namespace {

[[noreturn]] void answer_and_end(const std::function<void(void*)>& body, void* shared, int done) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  int code = 0;
  try {
    body(shared);
    const char yes = 1;
    if (write(done, &yes, 1) != 1) code = 1;
  } catch (const std::exception&) {
    code = 1;  // told by the missing answer
  }
  _exit(code);
}

bool wait_for(int done, int64_t patience_ns) {
  pollfd wait{done, POLLIN, 0};
  int ready = 0;
  do ready = poll(&wait, 1, static_cast<int>(patience_ns / 1'000'000));
  while (ready < 0 && errno == EINTR);
  char yes = 0;
  return ready == 1 && read(done, &yes, 1) == 1;
}

}  // namespace

bool ask_child(const std::function<void(void*)>& body, void* answer, size_t bytes, int64_t patience_ns) {
  void* shared = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) return false;
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) {
    munmap(shared, bytes);
    return false;
  }
  std::memcpy(shared, answer, bytes);
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) answer_and_end(body, shared, ends[1]);
  close(ends[1]);
  const bool answered = child > 0 && wait_for(ends[0], patience_ns);
  if (answered) std::memcpy(answer, shared, bytes);
  close(ends[0]);
  if (child > 0) {
    kill(child, SIGKILL);  // answered or not, nothing it does from now on is wanted
    while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  munmap(shared, bytes);
  return answered;
}

}  // namespace takt::machine::detail
