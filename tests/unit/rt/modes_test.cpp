// SPDX-License-Identifier: Apache-2.0
// Changes of mode while a run goes on, in virtual time; safe_stop; exceptions in jobs.
#include <doctest/doctest.h>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/job_watch.hpp"
#include "tests/unit/rt/epoch.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::kEpoch, test::kMs;

struct Notes final : Node {
  Output<Odometry> out{this, "out", ""};
  std::vector<int64_t> releases_ms;
  std::vector<std::string> modes;
  std::function<void(Job&)> act;
  void setup(Setup&) override {}
  void run(Job& job) override {
    releases_ms.push_back((job.release_ns() - kEpoch) / kMs);
    modes.emplace_back(job.mode());
    if (act) act(job);
    if (out.loan() != nullptr) out.send(job.release_ns());
  }
};

/// Two nodes at 10 Hz; the mode `safe_stop` leaves the second one out.
struct ModesScene {
  Notes first, second;
  Plan plan;
  VirtualClock clock{kEpoch};
  std::unique_ptr<RunBoard> board;

  ModesScene() {
    test::add_task(plan, first, "first", 0);
    test::add_task(plan, second, "second", 50 * kMs);
    plan.modes = {{"full", {1, 1}}, {"half", {0, 1}}, {"safe_stop", {1, 0}}};
    plan.safe_stop = 2;
  }
  RunResult run(const std::function<void(RunBoard&)>& before = {}, int64_t second_takes_ns = kMs) {
    const auto transport = make_local_transport(plan.ports);
    board = std::make_unique<RunBoard>(plan);
    if (before) before(*board);
    Executor::Options options;
    options.duration_ns = 1000 * kMs;
    options.board = board.get();
    options.job_duration_ns = [=](size_t task, uint64_t) { return task == 1 ? second_takes_ns : kMs; };
    Executor executor(plan, *transport, clock, options);
    return executor.run();
  }
};

}  // namespace

TEST_CASE("a change of mode holds for releases at or after its instant, and released counts honour it") {
  ModesScene scene;
  const RunResult result = scene.run([](RunBoard& board) {
    CHECK(board.modes().request(1, kEpoch + 300 * kMs, "a test"));
    CHECK(board.modes().request(0, kEpoch + 600 * kMs + 1, "a test"));
    CHECK(board.modes().request(0, kEpoch + 700 * kMs, "is it already"));
  });
  CHECK(scene.board->modes().size() == 2);
  CHECK(scene.first.releases_ms == std::vector<int64_t>{0, 100, 200, 700, 800, 900});
  CHECK(result.released[0] == 6);
  CHECK(scene.board->task(0).completed.load() == 6);
  CHECK(result.released[1] == 10);
  CHECK(left_out_jobs(scene.plan, *scene.board, 0, result.epoch_ns, result.end_ns) == 4);
  REQUIRE(scene.second.modes.size() == 10);
  CHECK(scene.second.modes[2] == "full");
  CHECK(scene.second.modes[3] == "half");
  CHECK(scene.second.modes[5] == "half");
  CHECK(scene.second.modes[6] == "full");
}

TEST_CASE("instants of changes never go back") {
  ModeLog log;
  CHECK(log.request(1, 100, ""));
  CHECK(log.request(2, 50, ""));
  CHECK(log.at(99) == 0);
  CHECK(log.at(100) == 2);
  CHECK(log.newest() == 2);
}

TEST_CASE("a mode that rules have left again and again is still the one to go back to") {
  ModeLog log;
  CHECK(log.request(3, 10, "a person"));
  for (uint32_t i = 0; i < 1000; ++i) {
    CHECK(log.request_by_rule(1 + i % 2, 20 + i, "lost"));
    CHECK(log.in_force().before == 3);
  }
  CHECK(log.request(4, 5000, "a person"));
  CHECK(log.in_force().before == 4);
  CHECK(log.request_by_rule(1, 5001, "lost"));
  CHECK(log.in_force().mode == 1);
  CHECK(log.in_force().before == 4);
}

TEST_CASE("of many changes the newest reasons are kept, and an older one says that it is not") {
  ModeLog log;
  constexpr size_t kChanges = 2 * ModeLog::kReasons;
  for (uint32_t i = 0; i < kChanges; ++i) CHECK(log.request(1 + i % 2, i, "reason " + std::to_string(i)));
  CHECK(log.reason(kChanges - 1) == "reason " + std::to_string(kChanges - 1));
  CHECK(log.reason(kChanges - 448) == "reason " + std::to_string(kChanges - 448));
  CHECK(log.reason(kChanges - 449) == "(reasons of the newest 448 changes are kept)");
  CHECK(log.reason(0) == log.reason(kChanges - 449));
}

TEST_CASE("a person cannot use up all changes: a safe stop has its place") {
  ModeLog log;
  uint32_t asked = 0;
  while (asked < 2 * ModeLog::kMost && log.request(asked % 2 + 1, asked, "", true)) ++asked;
  CHECK(asked < ModeLog::kMost);
  CHECK(log.request(7, asked, "safe_stop"));
  CHECK(log.newest() == 7);
}

TEST_CASE("on_miss: safe_stop changes the mode when the first deadline is missed, and says why") {
  ModesScene scene;
  scene.plan.tasks[0].on_miss = OnMiss::safe_stop;
  scene.plan.tasks[0].deadline_ns = kMs / 2;  // the budget is 1 ms
  scene.run();
  CHECK(scene.second.releases_ms.empty());
  CHECK(scene.first.releases_ms.size() == 10);
  CHECK(scene.first.modes.front() == "full");
  CHECK(scene.first.modes.back() == "safe_stop");
  REQUIRE(scene.board->modes().size() == 1);
  CHECK(scene.board->modes().reason(0) == "first: deadline missed");
  CHECK(scene.board->modes().change(0)->from_ns == kEpoch + kMs);
}

TEST_CASE("on_overrun: safe_stop changes the mode") {
  ModesScene scene;
  scene.plan.tasks[1].on_overrun = OnOverrun::safe_stop;
  scene.run({}, kMs + 1);
  CHECK(scene.second.releases_ms == std::vector<int64_t>{50});
  CHECK(scene.first.modes.back() == "safe_stop");
}

TEST_CASE("a job that throws loses its result and is told; the run goes on") {
  ModesScene scene;
  scene.first.act = [](const Job& job) {
    if (job.index() == 3) throw std::runtime_error("out of luck");
  };
  scene.run();
  CHECK(scene.first.releases_ms.size() == 10);
  CHECK(scene.board->task(0).no_result.load() == 1);
  REQUIRE(scene.board->faults().size() == 1);
  CHECK(std::string(scene.board->faults().at(0)->what.text()) == "first: job 3 threw: out of luck");
}

TEST_CASE("a job that says that its results are doubtful or wrong is told, and they count all the same") {
  ModesScene scene;
  scene.first.act = [](Job& job) {
    if (job.index() == 2) job.results_doubtful("blurred");
    if (job.index() == 5) job.results_wrong(std::string(300, 'x'));
  };
  scene.run();
  CHECK(scene.board->task(0).no_result.load() == 0);
  CHECK(scene.board->task(0).completed.load() == 10);
  REQUIRE(scene.board->faults().size() == 2);
  const Fault &doubtful = *scene.board->faults().at(0), &wrong = *scene.board->faults().at(1);
  CHECK(doubtful.kind == Fault::doubtful);
  CHECK(doubtful.job == 2);
  CHECK(doubtful.at_ns == kEpoch + 200 * kMs);
  CHECK(std::string(doubtful.what.text()) == "first: blurred");
  CHECK(wrong.kind == Fault::wrong);
  CHECK(std::string(wrong.what.text()) == "first: " + std::string(159, 'x'));
}

TEST_CASE("events beyond the room of a log are counted") {
  AppendLog<int, 3> log;
  for (int i = 0; i < 3; ++i) CHECK(log.append(i));
  CHECK_FALSE(log.append(3));
  CHECK(log.size() == 3);
  CHECK(log.lost() == 1);
  CHECK(*log.at(2) == 2);
}

TEST_CASE("the watchdog never acts on a job that has ended, and an ending job waits for it") {
  JobWatch watch;
  watch.bind(Reservation{});
  watch.begin(2, 7, 100, 200);
  const JobWatch::Running job = watch.running();
  CHECK(job.member == 2);
  CHECK(job.index == 7);
  CHECK(job.release_ns == 100);
  CHECK(job.cpu_limit_ns == 200);
  CHECK_FALSE(job.acted);
  CHECK(watch.tell(job.serial));
  CHECK(watch.running().acted);
  CHECK_FALSE(watch.tell(job.serial));
  CHECK_FALSE(watch.end());
  CHECK(watch.running().serial == 0);
  watch.begin(0, 8, 100, 200);
  CHECK_FALSE(watch.tell(job.serial));
  watch.end();
  // Both at once: every job is told of at most once, and none hangs.
  std::atomic<bool> done{false};
  uint64_t told = 0, last = 0;
  std::thread other([&] {
    while (!done.load()) {
      const JobWatch::Running now = watch.running();
      if (now.serial == 0 || now.acted || !watch.tell(now.serial)) continue;
      CHECK(now.serial > last);
      last = now.serial;
      ++told;
    }
  });
  for (uint64_t i = 0; i < 20'000; ++i) {
    watch.begin(0, i, 0, 0);
    watch.end();
  }
  done.store(true);
  other.join();
  CHECK(told <= 20'000);
}
