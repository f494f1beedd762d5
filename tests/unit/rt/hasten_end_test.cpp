// SPDX-License-Identifier: Apache-2.0
// A process whose first thread has ended, with another one left that uses up a small reservation for ever.
#include "rt/supervise/hasten_end.hpp"

#include <doctest/doctest.h>
#include <sched.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "rt/sched/grant.hpp"
#include "rt/thread_state.hpp"

namespace {

using namespace takt;

/// What the process tells its maker.
struct Told {
  pid_t thread = 0;
  bool granted = false;
};

[[noreturn]] void live(Policy policy, int told_line, int go_line) {
  std::thread([=] {
    Told mine;
    mine.thread = gettid();
    const Reservation small = deadline_reservation(1'000'000, 300'000'000, 400'000'000);
    mine.granted = apply(policy == Policy::deadline ? small : Reservation{}).policy == policy;
    if (write(told_line, &mine, sizeof mine) != sizeof mine) _exit(1);
    for (std::atomic<bool> for_ever{true}; for_ever.load();) {
    }
  }).detach();
  char byte = 0;
  if (read(go_line, &byte, 1) != 1) _exit(1);
  for (;;) syscall(SYS_exit, 0);  // of this thread alone, and without unwinding what the test runner holds
}

/// A process of two threads, whose first one ends once somebody writes into its line.
struct Process {
  int told_line[2] = {-1, -1}, go_line[2] = {-1, -1};
  pid_t pid = 0;
  Told told;

  explicit Process(Policy policy) {
    REQUIRE(pipe(told_line) == 0);
    REQUIRE(pipe(go_line) == 0);
    // A program of its own: after a fork, this one may have threads that the child lacks.
    setenv("TAKT_TEST_PEER",
           (std::to_string(static_cast<int>(policy)) + " " + std::to_string(told_line[1]) + " " +
            std::to_string(go_line[0]))
               .c_str(),
           1);
    const char* arguments[] = {"peer", "--test-case=peer: two threads whose first one ends", "--no-skip", "--minimal",
                               nullptr};
    REQUIRE(posix_spawn(&pid, "/proc/self/exe", nullptr, nullptr, const_cast<char**>(arguments), environ) == 0);
    unsetenv("TAKT_TEST_PEER");
    close(std::exchange(told_line[1], -1));  // so that its end, too, is an answer
    REQUIRE(read(told_line[0], &told, sizeof told) == sizeof told);
  }
  ~Process() {
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    for (const int end : {told_line[0], go_line[0], go_line[1]}) close(end);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void end_first_thread() const {
    REQUIRE(write(go_line[1], "", 1) == 1);
    while (!is_ending(pid)) std::this_thread::yield();
  }
};

}  // namespace

// Started by the others in a process of its own.
TEST_CASE("peer: two threads whose first one ends" * doctest::skip()) {
  const char* says = std::getenv("TAKT_TEST_PEER");
  if (says == nullptr) return;
  int policy = 0, told_line = -1, go_line = -1;
  REQUIRE(std::sscanf(says, "%d %d %d", &policy, &told_line, &go_line) == 3);
  live(static_cast<Policy>(policy), told_line, go_line);
}

TEST_CASE("a thread that waits for its reservation is let go once its process is ending, and not before") {
  const Process process(Policy::deadline);
  if (!process.told.granted) {
    MESSAGE("NOT RUN: SCHED_DEADLINE is refused to this user");
    return;
  }
  CHECK_FALSE(is_ending(process.pid));
  CHECK(hasten_end(process.pid) == 0);
  CHECK(sched_getscheduler(process.told.thread) == (SCHED_DEADLINE | SCHED_RESET_ON_FORK));
  process.end_first_thread();
  CHECK(hasten_end(process.pid) == 1);
  CHECK((sched_getscheduler(process.told.thread) & ~SCHED_RESET_ON_FORK) != SCHED_DEADLINE);
  CHECK(hasten_end(process.pid) == 0);  // nobody has one any more
}

TEST_CASE("threads without a reservation stay as they are") {
  const Process process(Policy::cooperative);
  REQUIRE(process.told.granted);
  const int before = sched_getscheduler(process.told.thread);
  process.end_first_thread();
  CHECK(hasten_end(process.pid) == 0);
  CHECK(sched_getscheduler(process.told.thread) == before);
}

TEST_CASE(
    "a process is dead once no thread of it will run its program again: not while one has yet to come to its end") {
  const Process process(Policy::deadline);  // a used-up reservation keeps its second thread from that for a while
  CHECK_FALSE(signal_of_dead(process.pid));
  kill(process.pid, SIGUSR1);
  std::optional<int> signal;
  while (!(signal = signal_of_dead(process.pid))) std::this_thread::yield();
  CHECK(*signal == SIGUSR1);
  const std::optional<ThreadState> second = thread_state(process.told.thread);
  CHECK((!second || second->ending()));
}

TEST_CASE("one that ends by itself is not dead before the kernel says so") {
  const Process process(Policy::cooperative);
  process.end_first_thread();
  CHECK_FALSE(signal_of_dead(process.pid));
}

TEST_CASE("a process that is not there is not ending") {
  const pid_t gone = fork();
  REQUIRE(gone >= 0);
  if (gone == 0) _exit(0);
  REQUIRE(waitpid(gone, nullptr, 0) == gone);
  CHECK_FALSE(is_ending(gone));
  CHECK(hasten_end(gone) == 0);
  CHECK_FALSE(signal_of_dead(gone));
}
