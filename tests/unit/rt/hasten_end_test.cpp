// SPDX-License-Identifier: Apache-2.0
// A process whose first thread has ended, with another one left that uses up a small reservation for ever.
#include "rt/supervise/hasten_end.hpp"

#include <doctest/doctest.h>
#include <sched.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "rt/sched/grant.hpp"

namespace {

using namespace takt;

/// What the process tells its maker.
struct Told {
  pid_t thread = 0;
  bool granted = false;
};

/// A process of two threads, whose first one ends once somebody writes into `go`.
struct Process {
  int told_line[2] = {-1, -1}, go_line[2] = {-1, -1};
  pid_t pid = 0;
  Told told;

  explicit Process(Policy policy) {
    REQUIRE(pipe(told_line) == 0);
    REQUIRE(pipe(go_line) == 0);
    pid = fork();
    REQUIRE(pid >= 0);
    if (pid == 0) live(policy);
    REQUIRE(read(told_line[0], &told, sizeof told) == sizeof told);
  }
  ~Process() {
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    for (const int end : {told_line[0], told_line[1], go_line[0], go_line[1]}) close(end);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void end_first_thread() const {
    REQUIRE(write(go_line[1], "", 1) == 1);
    while (!is_ending(pid)) std::this_thread::yield();
  }

 private:
  [[noreturn]] void live(Policy policy) const {
    std::thread([this, policy] {
      Told mine;
      mine.thread = gettid();
      Reservation wanted = deadline_reservation(1'000'000, 300'000'000, 400'000'000);
      if (policy == Policy::cooperative) wanted = {};
      mine.granted = apply(wanted).policy == policy;
      if (write(told_line[1], &mine, sizeof mine) != sizeof mine) _exit(1);
      for (std::atomic<bool> for_ever{true}; for_ever.load();) {
      }
    }).detach();
    char byte = 0;
    if (read(go_line[0], &byte, 1) != 1) _exit(1);
    for (;;) syscall(SYS_exit, 0);  // of this thread alone, and without unwinding what the test runner holds
  }
};

}  // namespace

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
  process.end_first_thread();
  CHECK(hasten_end(process.pid) == 0);
  CHECK(sched_getscheduler(process.told.thread) == SCHED_OTHER);
}

TEST_CASE("a process that is not there is not ending") {
  const pid_t gone = fork();
  REQUIRE(gone >= 0);
  if (gone == 0) _exit(0);
  REQUIRE(waitpid(gone, nullptr, 0) == gone);
  CHECK_FALSE(is_ending(gone));
  CHECK(hasten_end(gone) == 0);
}
