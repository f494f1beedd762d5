// SPDX-License-Identifier: Apache-2.0
// What a process of a run may write on the board: its own records, the logs of all, and nothing else.
#include <doctest/doctest.h>

#include "commit_scene.hpp"
#include "rt/sched/run_board.hpp"
#include "stray_store.hpp"

using namespace takt;
using namespace takt::test;

namespace {

/// Two tasks of the same kind in two processes; the second reads the first.
Plan plan_of_two_pairs(PairNode& first, PairNode& second) {
  Plan plan = pair_plan(first);
  TaskPlan other = plan.tasks[0];
  other.name = "other";
  other.node = &second;
  other.ports = {2, 3};
  other.edges = {{0, 0, 1, 0}};
  plan.tasks.push_back(other);
  for (const PortPlan& port : pair_ports()) plan.ports.push_back(port);
  return plan;
}

}  // namespace

TEST_CASE("a process writes its own records and what all share; a store anywhere else on the board ends it") {
  PairNode first, second;
  const Plan plan = plan_of_two_pairs(first, second);
  const size_t process_of[] = {0, 1};
  RunBoard board(plan, 2, process_of);
  const auto dies = [&](size_t process, const std::function<void()>& store) {
    return dies_of_a_store([&] {
      board.keep_to(process);
      store();
    });
  };
  const std::function<void()> of_first[] = {[&] { board.task(0).completed.store(7); },
                                            [&] { board.port(1).published.store(7); },
                                            [&] { board.mail(0).param = 7; },
                                            [&] { board.set_grant(0, {}); },
                                            [&] { board.capacity(0).known.store(1); },
                                            [&] { board.source_facts(0).known.store(true); },
                                            [&] { board.process(0).restarts.store(7); },
                                            [&] { board.spare(0).ready.store(7); }};
  const std::function<void()> of_second[] = {
      [&] { board.task(1).completed.store(7); }, [&] { board.edge(1, 0).received = 7; },
      [&] { board.port(2).published.store(7); }, [&] { board.process(1).restarts.store(7); }};
  const std::function<void()> of_supervisor[] = {
      [&] { board.epoch_ns().store(7); }, [&] { board.decision().store(RunBoard::as_asked); },
      [&] { board.group().heartbeat_ns.store(7); }, [&] { board.dismissed().store(true); },
      [&] { board.spare_order(0).takes_over.store(7); }};
  const std::function<void()> of_all[] = {[&] { board.faults().append({}); }, [&] { board.commits(0).note_spoiled(); },
                                          [&] { board.overruns().append({}); }};
  const auto check = [&](std::span<const std::function<void()>> stores, bool first_may, bool second_may) {
    for (size_t at = 0; at < stores.size(); ++at) {
      CAPTURE(at);
      CHECK(dies(0, stores[at]) != first_may);
      CHECK(dies(1, stores[at]) != second_may);
    }
  };
  check(of_first, true, false);
  check(of_second, false, true);
  check(of_supervisor, false, false);
  check(of_all, true, true);
  // The supervisor keeps to nothing, and sees what they wrote.
  CHECK(board.task(0).completed == 7);
  CHECK(board.edge(1, 0).received == 7);
  board.task(1).completed.store(8);
}

TEST_CASE("a mode that no plan has is the mode of the start") {
  PairNode node;
  const Plan plan = pair_plan(node);
  RunBoard board(plan);
  board.modes().request(12'345, 0, "a stray store");
  CHECK(board.mode_at(kEpoch) == 0);
}

TEST_CASE("a stop and a mode that a process asks for hold in all others at once, and are entered by the supervisor") {
  PairNode first, second;
  const Plan plan = [&] {
    Plan two = plan_of_two_pairs(first, second);
    two.modes.resize(3);
    two.safe_stop = 2;
    return two;
  }();
  const size_t process_of[] = {0, 1};
  RunBoard board(plan, 2, process_of);
  const auto in_process = [&](size_t process, const std::function<void()>& deed) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      board.keep_to(process);
      deed();
      _exit(0);
    }
    int status = -1;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(status == 0);
  };
  in_process(0, [&] { board.modes().request_by_rule(1, kEpoch + 10, "camera lost"); });
  CHECK(board.mode_at(kEpoch + 9) == 0);
  CHECK(board.mode_at(kEpoch + 10) == 1);
  CHECK(board.modes().size() == 0);
  in_process(1, [&] {
    if (board.mode_at(kEpoch + 10) != 1) _exit(1);
    board.safe_stop(kEpoch + 5, "hangs");  // asked for later, so it does not come before
    board.stop().raise(kEpoch + 3000);
    board.stop().set_planned_end(0);  // that is the supervisor's
  });
  CHECK(board.mode_at(kEpoch + 10) == 1);
  CHECK(board.mode_at(kEpoch + 11) == 2);
  CHECK(board.stop().end_ns() == (kEpoch + 3000) / 1000 * 1000);
  board.modes().gather();
  board.modes().gather();
  REQUIRE(board.modes().size() == 2);
  CHECK(board.modes().reason(1) == "hangs");
  CHECK(board.mode_at(kEpoch + 10) == 1);
  CHECK(board.mode_at(kEpoch + 11) == 2);
}
