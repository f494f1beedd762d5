// SPDX-License-Identifier: Apache-2.0
#include "rt/thread_state.hpp"

#include <doctest/doctest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <thread>

namespace {

using namespace takt;

constexpr const char* kName = "a) R 1 (b";  // as a kernel line that says "runs" would look like

}  // namespace

TEST_CASE("the thread that asks runs, whatever its name") {
  std::thread([] {
    REQUIRE(prctl(PR_SET_NAME, kName) == 0);
    const std::optional<ThreadState> mine = thread_state(gettid());
    REQUIRE(mine.has_value());
    CHECK(mine->runnable());
    CHECK_FALSE(mine->ending());
  }).join();
}

TEST_CASE("a thread that waits is not runnable, whatever its name") {
  int line[2];
  REQUIRE(pipe(line) == 0);
  std::atomic<pid_t> id{0};
  std::thread waiting([&] {
    prctl(PR_SET_NAME, kName);
    id = gettid();
    char byte = 0;
    while (read(line[0], &byte, 1) < 0) {
    }
  });
  while (id == 0) std::this_thread::yield();
  std::optional<ThreadState> told;
  do {
    std::this_thread::yield();
    told = thread_state(id);
  } while (told && told->state != 'S');
  REQUIRE(told.has_value());
  CHECK_FALSE(told->runnable());
  CHECK_FALSE(told->ending());
  close(line[1]);
  waiting.join();
  close(line[0]);
}

TEST_CASE("a process that has ended is told as such until its parent asks, and not at all afterwards") {
  const pid_t ended = fork();
  REQUIRE(ended >= 0);
  if (ended == 0) _exit(0);
  siginfo_t info;
  REQUIRE(waitid(P_PID, static_cast<id_t>(ended), &info, WEXITED | WNOWAIT) == 0);
  const std::optional<ThreadState> told = thread_state(ended);
  REQUIRE(told.has_value());
  CHECK(told->ended());
  CHECK(told->ending());
  CHECK_FALSE(told->runnable());
  REQUIRE(waitpid(ended, nullptr, 0) == ended);
  CHECK_FALSE(thread_state(ended).has_value());
}
