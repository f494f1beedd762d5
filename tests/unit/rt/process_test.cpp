// SPDX-License-Identifier: Apache-2.0
// Processes of a run and the board they share.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <future>
#include <stdexcept>
#include <thread>

#include "rt/sched/run_board.hpp"
#include "rt/supervise/process_group.hpp"

namespace {

using namespace takt;

ProcessGroup::End wait_for_end(ProcessGroup& group) {
  for (;;) {
    siginfo_t ended;  // waited for, but left for the group to reap
    const int waited = waitid(P_ALL, 0, &ended, WEXITED | WNOWAIT);
    REQUIRE((waited == 0 || errno == EINTR));
    if (const auto end = group.reap()) return *end;
  }
}

/// Lets one process wait for what another has done, or for its end.
struct Bell {
  std::array<int, 2> ends{};
  Bell() { REQUIRE(pipe(ends.data()) == 0); }
  ~Bell() {
    close(ends[0]);
    close(ends[1]);
  }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;
  bool ring() const { return write(ends[1], "", 1) == 1; }
  /// In the process that made it: false if the other has ended without a ring.
  bool wait() {
    close(ends[1]);
    ends[1] = -1;
    char rung = 1;
    ssize_t got;
    while ((got = read(ends[0], &rung, 1)) < 0 && errno == EINTR) {
    }
    return got == 1;
  }
};

Plan plan_of_two() {
  Plan plan;
  plan.tasks.resize(2);
  plan.tasks[0].edges.resize(2);
  plan.tasks[1].edges.resize(1);
  plan.ports.resize(3);
  return plan;
}

}  // namespace

TEST_CASE("what a process writes onto the board stays there when it is killed") {
  RunBoard board(plan_of_two(), 2);
  Bell bell;
  ProcessGroup group;
  group.start("writer", [&] {
    board.task(1).completed.store(41);
    board.task(1).exec.add(5'000'000);
    board.edge(1, 0).received = 7;
    board.port(2).writer.sent = 9;
    Grant grant;
    grant.policy = Policy::deadline;
    grant.verified = true;
    grant.cpus = {0, 65};
    grant.refused = "not refused";
    board.set_grant(1, grant);
    board.process(1).state.store(ProcessRecord::running);
    if (!bell.ring()) return 1;
    for (;;) pause();
    return 0;
  });
  REQUIRE(bell.wait());
  CHECK(board.process(1).state.load() == ProcessRecord::running);
  kill(group.pid(0), SIGKILL);
  const ProcessGroup::End end = wait_for_end(group);
  CHECK(end.signal == SIGKILL);
  CHECK(end.code == -1);
  CHECK(group.alive() == 0);
  CHECK(board.task(1).completed.load() == 41);
  CHECK(board.task(1).exec.count() == 1);
  CHECK(board.edge(1, 0).received == 7);
  CHECK(board.edge(0, 1).received == 0);
  CHECK(board.port(2).writer.sent == 9);
  CHECK(board.grant(1).policy == Policy::deadline);
  CHECK(board.grant(1).verified);
  CHECK(board.grant(1).cpus == std::vector<int>{0, 65});
  CHECK(board.grant(1).refused == "not refused");
}

TEST_CASE("a process ends with the code of its body, with 1 if that throws, and ignores signals that its group gets") {
  ProcessGroup group;
  group.start("good", [] { return 0; });
  group.start("bad", [] { return 3; });
  group.start("broken", []() -> int { throw std::runtime_error("as the test wants it"); });
  group.start("interrupted", [] {
    raise(SIGINT);
    raise(SIGHUP);
    raise(SIGTERM);
    return 5;
  });
  group.start("strange", []() -> int { throw 7; });
  int codes[5] = {};
  for (int i = 0; i < 5; ++i) {
    const ProcessGroup::End end = wait_for_end(group);
    codes[end.process] = end.code;
  }
  CHECK(codes[0] == 0);
  CHECK(codes[1] == 3);
  CHECK(codes[2] == 1);
  CHECK(codes[3] == 5);
  CHECK(codes[4] == 1);
  CHECK_FALSE(group.reap());
}

TEST_CASE("no process outlives its group") {
  pid_t pid = 0;
  {
    ProcessGroup group;
    group.start("endless", [] {
      for (;;) pause();
      return 0;
    });
    pid = group.pid(0);
    CHECK(kill(pid, 0) == 0);
  }
  CHECK(kill(pid, 0) != 0);
}

TEST_CASE("a process is started again although its supervisor has threads by now, with what was there before them") {
  RunBoard board(plan_of_two(), 1);
  ProcessGroup group;
  int told = 7;
  group.start("phoenix", [&] {
    board.task(0).completed.fetch_add(1);
    return told + static_cast<int>(board.process(0).restarts.load());
  });
  group.prepare_restarts();
  CHECK(wait_for_end(group).code == 7);
  told = 100;  // after the nursery was made
  std::promise<void> end;
  std::thread other([&] { end.get_future().wait(); });
  for (uint32_t again = 1; again <= 3; ++again) {
    board.process(0).restarts.store(again);
    REQUIRE(group.restart(0));
    CHECK(group.pid(0) > 0);
    CHECK_FALSE(group.restart(0));  // it lives
    CHECK(wait_for_end(group).code == 7 + static_cast<int>(again));
  }
  CHECK(board.task(0).completed.load() == 4);
  end.set_value();
  other.join();
}

TEST_CASE("a process that was started again does not outlive its group, and none is started without a nursery") {
  pid_t pid = 0;
  {
    ProcessGroup group;
    group.start("endless", [] {
      for (;;) pause();
      return 0;
    });
    group.prepare_restarts();
    kill(group.pid(0), SIGKILL);
    CHECK(wait_for_end(group).signal == SIGKILL);
    REQUIRE(group.restart(0));
    pid = group.pid(0);
    CHECK(kill(pid, 0) == 0);
  }
  CHECK(kill(pid, 0) != 0);
  ProcessGroup without;
  without.start("mayfly", [] { return 0; });
  wait_for_end(without);
  CHECK_FALSE(without.restart(0));
}

TEST_CASE("whoever makes restarts possible may die or fall silent: its spare takes its place and gets a new one") {
  ProcessGroup group;
  group.start("phoenix", [] { return 7; });
  group.prepare_restarts();
  CHECK(wait_for_end(group).code == 7);
  const auto wait_for = [](pid_t pid) {  // its death, which the group is left to see
    siginfo_t ended;
    while (waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT) != 0) REQUIRE(errno == EINTR);
  };
  for (int again = 0; again < 6; ++again) {
    const std::vector<pid_t> before = group.nurseries();
    REQUIRE(before.size() == 2);
    const pid_t victim = before[again < 4 ? 0 : 1];
    CAPTURE(again);
    if (again % 2 == 0) {
      kill(victim, SIGKILL);
      wait_for(victim);
    } else {
      kill(victim, SIGSTOP);  // it is only missed when it is asked
    }
    REQUIRE(group.restart(0));
    CHECK(wait_for_end(group).code == 7);
    if (again == 5) kill(victim, SIGCONT);  // the spare was not asked
  }
  CHECK(group.lost_nurseries() == 5);
  CHECK_FALSE(group.reap());
  CHECK(group.nurseries().size() == 2);
}

TEST_CASE("both lost at once: no restart, which is told, and nobody waits for ever") {
  ProcessGroup group;
  group.start("phoenix", [] { return 7; });
  group.prepare_restarts();
  CHECK(wait_for_end(group).code == 7);
  for (const pid_t nursery : group.nurseries()) kill(nursery, SIGSTOP);
  CHECK_FALSE(group.restart(0));
  CHECK(group.nurseries().empty());
  CHECK(group.lost_nurseries() == 2);
  CHECK_FALSE(group.restart(0));
}

TEST_CASE("a spare takes the place of a process that has ended, once, and waits until then") {
  RunBoard board(plan_of_two(), 1);
  Bell waits;
  ProcessGroup group;
  group.start(
      "phoenix", [] { return 7; },
      [&] {
        if (!waits.ring()) return 1;
        while (board.spare_order(0).takes_over.load() != getpid()) std::this_thread::yield();
        return 9;
      });
  group.prepare_restarts();
  CHECK_FALSE(group.take_over(0));  // there is none
  REQUIRE(group.start_spare(0));
  CHECK_FALSE(group.start_spare(0));
  const pid_t spare = group.spare(0);
  CHECK(group.alive() == 2);
  CHECK(wait_for_end(group).code == 7);
  REQUIRE(waits.wait());
  REQUIRE(group.take_over(0));
  CHECK(group.pid(0) == spare);
  CHECK(group.spare(0) == 0);
  CHECK_FALSE(group.restart(0));  // it lives
  board.spare_order(0).takes_over.store(spare);
  const ProcessGroup::End end = wait_for_end(group);
  CHECK(end.of == ProcessGroup::End::member);
  CHECK(end.code == 9);
  CHECK(group.alive() == 0);
}

TEST_CASE("a spare that dies is told as one, and the process may have another; one without a body has none") {
  ProcessGroup group;
  const auto endless = [] {
    for (;;) pause();
    return 0;
  };
  group.start("one", endless, endless);
  group.start("other", endless);
  CHECK_FALSE(group.start_spare(0));  // nobody can fork it yet
  group.prepare_restarts();
  CHECK_FALSE(group.start_spare(1));
  REQUIRE(group.start_spare(0));
  const pid_t first = group.spare(0);
  group.end_spare(0);
  const ProcessGroup::End end = wait_for_end(group);
  CHECK(end.of == ProcessGroup::End::spare);
  CHECK(end.process == 0);
  CHECK(end.signal == SIGKILL);
  CHECK(group.pid(0) > 0);
  REQUIRE(group.start_spare(0));
  CHECK(group.spare(0) != first);
}

TEST_CASE("the place of a dead process is free before the kernel has cleared it up, and it is told again then") {
  ProcessGroup group;
  group.start("one", [] {
    for (;;) pause();
    return 0;
  });
  CHECK_FALSE(group.early_end(0));  // it lives
  const pid_t pid = group.pid(0);
  kill(pid, SIGUSR1);
  siginfo_t ended;  // waited for, but left for the group to reap
  while (waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT) != 0) REQUIRE(errno == EINTR);
  const auto early = group.early_end(0);
  REQUIRE(early);
  CHECK(early->signal == SIGUSR1);
  CHECK(early->pid == pid);
  CHECK(group.pid(0) == 0);
  CHECK(group.alive() == 1);
  CHECK_FALSE(group.early_end(0));  // once
  const ProcessGroup::End end = wait_for_end(group);
  CHECK(end.of == ProcessGroup::End::cleared);
  CHECK(end.pid == pid);
  CHECK(group.alive() == 0);
}
