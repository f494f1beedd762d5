// SPDX-License-Identifier: Apache-2.0
// Jobs that do not return, in real time: who is told, who is demoted, and that the run ends. Counts only, no times.
#include <doctest/doctest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/watchdog.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

struct Steady final : Node {
  void setup(Setup&) override {}
  void run(Job&) override {}
};

/// From job 3 on (on a busy machine that one may be skipped) it spins until it is let go, or has used so much.
struct Spinner final : Node {
  std::atomic<bool> let_go{false};
  int64_t spin_ns = INT64_MAX / 2;
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (job.index() < 3) return;
    const int64_t until_ns = thread_cpu_ns() + spin_ns;
    while (!let_go.load() && thread_cpu_ns() < until_ns) {
    }
  }
};

/// Notes the policy under which the thread that ran its jobs comes to its end.
struct EndsUnder final : Node {
  static inline std::atomic<int> policy{-1};
  void setup(Setup&) override {}
  void run(Job&) override {
    struct AtEnd {
      ~AtEnd() { policy.store(sched_getscheduler(0) & ~SCHED_RESET_ON_FORK); }
    };
    thread_local const AtEnd at_end;
    (void)&at_end;
  }
};

struct SpinnerScene {
  Steady steady;
  Spinner spinner;
  Plan plan;
  MonotonicClock clock;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Executor> executor;

  SpinnerScene(Policy policy, Criticality criticality) {
    plan.policy = policy;
    plan.cores = {0, 1};
    plan.modes = {{"full", {1, 1}}, {"safe_stop", {1, 0}}};
    plan.safe_stop = 1;
    add(steady, "steady", Criticality::high, 90 * kMs);
    add(spinner, "spinner", criticality, 50 * kMs);
    board = std::make_unique<RunBoard>(plan);
  }
  void add(Node& node, const char* name, Criticality criticality, int64_t deadline_ns) {
    TaskPlan task;
    task.name = name;
    task.node = &node;
    task.rate = Rate{10, 1};
    task.budget_ns = 5 * kMs;
    task.deadline_ns = deadline_ns;
    task.criticality = criticality;
    plan.tasks.push_back(task);
  }
  RunResult run(int64_t duration_ns, int64_t patience_ns = 100 * kMs) {
    transport = make_local_transport(plan.ports);
    Executor::Options options;
    options.duration_ns = duration_ns;
    options.board = board.get();
    options.hang_patience_ns = patience_ns;
    executor = std::make_unique<Executor>(plan, *transport, clock, options);
    return executor->run();
  }
};

std::vector<std::unique_ptr<SpinnerScene>>& kept_scenes() {
  static auto& scenes = *new std::vector<std::unique_ptr<SpinnerScene>>;
  return scenes;
}

/// Kept for ever: a thread that was given up may use it until the process ends.
SpinnerScene& new_scene(Policy policy, Criticality criticality = Criticality::low) {
  return *kept_scenes().emplace_back(std::make_unique<SpinnerScene>(policy, criticality));
}

/// The spinner need not spin through all other tests.
struct LetGo {
  Spinner& spinner;
  ~LetGo() { spinner.let_go.store(true); }
};

}  // namespace

TEST_CASE("without real-time policies a job that does not return is named and ends the run") {
  SpinnerScene& scene = new_scene(Policy::cooperative);
  const LetGo let_go{scene.spinner};
  const RunResult result = scene.run(3'600'000 * kMs);
  REQUIRE(result.stuck.size() == 1);
  CHECK(result.stuck[0] == 1);
  CHECK(result.duration_s() < 3600);
  REQUIRE(scene.board->faults().size() == 1);
  CHECK(scene.board->faults().at(0)->kind == Fault::hang);
  CHECK(scene.board->faults().at(0)->task == 1);
  CHECK(scene.board->faults().at(0)->job >= 3);
  CHECK(scene.board->task(1).deadline_misses.load() >= 1);
  CHECK(scene.board->task(1).completed.load() + scene.board->task(1).skipped.load() ==
        scene.board->faults().at(0)->job);
}

TEST_CASE("under fixed a job that does not return is demoted, and the run goes on to its planned end") {
  SpinnerScene& scene = new_scene(Policy::fixed);
  const LetGo let_go{scene.spinner};
  const RunResult result = scene.run(1'500 * kMs);
  if (result.policy_granted != Policy::fixed) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  REQUIRE(result.stuck.size() == 1);
  CHECK(result.stuck[0] == 1);
  CHECK(scene.board->task(1).demoted.load() == 1);
  CHECK(scene.board->task(1).budget_overruns.load() == 1);
  CHECK(result.released[0] == 15);
  CHECK(scene.board->task(0).completed.load() + scene.board->task(0).skipped.load() == 15);
  CHECK(scene.board->task(0).demoted.load() == 0);
  MESSAGE("demoted with " << scene.board->task(1).enforcement_error_ns.load() / 1000 << " us beyond its budget");
}

TEST_CASE("under fixed a worker that is through with its jobs ends behind those of others") {
  SpinnerScene& scene = new_scene(Policy::fixed);
  EndsUnder node;
  scene.plan.tasks[1].node = &node;
  const RunResult result = scene.run(300 * kMs);
  if (result.policy_granted != Policy::fixed) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  CHECK(result.stuck.empty());
  CHECK(EndsUnder::policy.load() == SCHED_OTHER);
}

TEST_CASE("under fixed a high node that does not return is demoted, named, and safe_stop entered") {
  SpinnerScene& scene = new_scene(Policy::fixed, Criticality::high);
  const LetGo let_go{scene.spinner};
  const RunResult result = scene.run(1'500 * kMs);
  if (result.policy_granted != Policy::fixed) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  REQUIRE(result.stuck.size() == 1);
  CHECK(scene.board->task(1).demoted.load() == 1);
  REQUIRE(scene.board->faults().size() >= 1);
  const Fault& fault = *scene.board->faults().at(0);
  CHECK(fault.kind == Fault::hang);
  CHECK(fault.task == 1);
  CHECK(std::string(fault.what.text()).find("it is demoted, and safe_stop entered") != std::string::npos);
  REQUIRE(scene.board->modes().size() >= 1);
  CHECK(scene.board->modes().change(0)->mode == 1);
}

TEST_CASE("under fixed the jobs after one that was demoted are watched as it was") {
  SpinnerScene& scene = new_scene(Policy::fixed);
  const LetGo let_go{scene.spinner};
  scene.spinner.spin_ns = 20 * kMs;  // of 5
  const RunResult result = scene.run(1'500 * kMs, 3'600'000 * kMs);
  if (result.policy_granted != Policy::fixed) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  CHECK(scene.board->task(1).completed.load() >= 4);
  CHECK(scene.board->task(1).demoted.load() == scene.board->task(1).budget_overruns.load());
}

TEST_CASE("a demoted job that returns gets its priority back, and its node runs on") {
  bool granted = false;
  std::thread([&] { granted = apply({Policy::fixed, 0, 0, 0, 1, -1}).refused.empty(); }).join();
  if (!granted) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  SpinnerScene& scene = new_scene(Policy::fixed);
  std::thread friendly([&] {
    while (scene.board->task(1).demoted.load() == 0) std::this_thread::yield();
    scene.spinner.let_go.store(true);
  });
  // How soon a demoted job gets its share is the machine's to say: no patience would be sure to be long enough.
  const RunResult result = scene.run(1'500 * kMs, 3'600'000 * kMs);
  friendly.join();
  REQUIRE(result.policy_granted == Policy::fixed);
  CHECK(result.stuck.empty());
  CHECK(scene.board->task(1).completed.load() >= 4);
  CHECK(scene.board->task(1).demoted.load() == 1);
  CHECK(scene.board->faults().size() == 0);
}

namespace {

int own_policy() { return sched_getscheduler(0) & ~SCHED_RESET_ON_FORK; }
/// 0 but under SCHED_FIFO.
int own_priority() {
  sched_param param{};
  sched_getparam(0, &param);
  return param.sched_priority;
}

/// Job 3 takes far more than its budget, as if the host had taken it; the others nothing.
struct Stalled final : Node {
  bool was_first = false;     ///< before all workers at any instant of any job: a lift may end before its job does
  std::vector<int> policies;  ///< after each job, as the kernel says
  void setup(Setup&) override { policies.reserve(100); }
  void run(Job& job) override {
    const int64_t until_ns = thread_cpu_ns() + (job.index() == 3 ? 100 * kMs : 0);
    do {
      was_first = was_first || own_priority() == kHighestPriority;
    } while (thread_cpu_ns() < until_ns);
    policies.push_back(own_policy());
  }
};

}  // namespace

TEST_CASE(
    "under deadline a late job that pays for time of the host goes first, and its thread takes its reservation back") {
  constexpr int kDeadline = 6;  // SCHED_DEADLINE
  bool host_takes = false;
  SUBCASE("the host took it") { host_takes = true; }
  SUBCASE("the job used it itself") {}
  CAPTURE(host_takes);
  Plan plan;
  plan.policy = Policy::deadline;
  Stalled node;
  node.policies.reserve(100);
  TaskPlan task;
  task.name = "stalled";
  task.node = &node;
  task.rate = Rate{20, 1};
  task.budget_ns = 4 * kMs;
  task.deadline_ns = 50 * kMs;
  plan.tasks.push_back(task);
  RunBoard board(plan);
  const auto transport = make_local_transport(plan.ports);
  MonotonicClock clock;
  Executor::Options options;
  options.duration_ns = 6'000 * kMs;
  options.board = &board;
  // The machine's own counter would decide otherwise. For a second, in which the long job falls.
  options.stolen_ns = [&, reads = 0]() mutable { return host_takes ? std::min(++reads, 20) * 100 * kMs : 0; };
  const RunResult result = Executor(plan, *transport, clock, options).run();
  if (result.policy_granted != Policy::deadline) {
    MESSAGE("NOT RUN: SCHED_DEADLINE is refused to this user");
    return;
  }
  CHECK(board.task(0).lifted.load() > 0);  // while it was in time, behind all workers
  CHECK(node.was_first == host_takes);
  REQUIRE_FALSE(node.policies.empty());
  CHECK(node.policies.back() == kDeadline);
}

TEST_CASE("a worker whose reservation is used up goes on beside it, in its job and before its job has begun") {
  bool begun = true;
  Criticality criticality = Criticality::high;
  SUBCASE("high, in its job") {}
  SUBCASE("high, before it") { begun = false; }
  SUBCASE("low, in its job") { criticality = Criticality::low; }
  SUBCASE("low, before it") {
    criticality = Criticality::low;
    begun = false;
  }
  const int beside = criticality == Criticality::high ? kHighestPriority : kLowestPriority;
  CAPTURE(beside);
  Steady node;
  Plan plan;
  TaskPlan task;
  task.name = "guard";
  task.node = &node;
  task.rate = Rate{1, 1};
  task.budget_ns = 5 * kMs;
  task.deadline_ns = 900 * kMs;
  task.criticality = criticality;
  plan.tasks.push_back(task);
  RunBoard board(plan);
  MonotonicClock clock;
  JobWatch watch;
  bool granted = false, was_lifted = false;
  std::thread worker([&] {
    Reservation has = deadline_reservation(task.budget_ns, task.deadline_ns, task.rate->period_ns());
    watch.bind(
        has);  // before the kernel's account begins: what it sees as used up is never more than what the watch sees
    granted = apply(has).policy == Policy::deadline;  // it reclaims nothing
    if (!granted) return;
    const int64_t release_ns = clock.now_ns(), cpu_ns = thread_cpu_ns();
    watch.expect(release_ns);
    if (begun) watch.begin(0, 0, release_ns, cpu_ns + task.budget_ns);
    Watchdog::Options options;
    options.granted = Policy::deadline;
    options.priority = kHighestPriority + 1;
    const Watchdog watchdog(plan, board, clock, {{&watch, {0}}}, options);
    while (thread_cpu_ns() - cpu_ns < 40 * kMs) was_lifted = was_lifted || own_priority() == beside;
    if (begun) watch.end();
  });
  worker.join();
  if (!granted) {
    MESSAGE("NOT RUN: SCHED_DEADLINE is refused to this user");
    return;
  }
  CHECK(was_lifted);
  CHECK(board.task(0).lifted.load() == 1);
}

TEST_CASE("a worker that came back without its reservation asks for it after each job, and has it once it is granted") {
  constexpr int kDeadline = 6;  // SCHED_DEADLINE
  bool granted = false;
  int before = 0, after = 0;
  Grant read_back;
  JobWatch watch;
  std::thread([&] {
    const Reservation wanted = deadline_reservation(kMs, 90 * kMs, 100 * kMs);
    granted = apply(wanted).policy == Policy::deadline;
    if (!granted) return;
    apply(fixed_reservation(kLowestPriority));
    watch.bind_beside(wanted, /*behind=*/true);
    CHECK(watch.lifted());
    before = own_policy();
    watch.begin(0, 0, 0, kMs);
    watch.end();
    after = own_policy();
    read_back = watch.grant();
  }).join();
  if (!granted) {
    MESSAGE("NOT RUN: SCHED_DEADLINE is refused to this user");
    return;
  }
  CHECK(before == SCHED_FIFO);
  CHECK(after == kDeadline);
  CHECK_FALSE(watch.lifted());
  CHECK(watch.refusals() == 1);
  CHECK(read_back.policy == Policy::deadline);
  CHECK(read_back.verified);
}

TEST_CASE("a worker whose reservation stays refused runs on under SCHED_FIFO; the refusals are counted and told") {
  Steady node;
  Plan plan;
  TaskPlan task;
  task.name = "guard";
  task.node = &node;
  task.rate = Rate{10, 1};
  task.budget_ns = 5 * kMs;
  task.deadline_ns = 90 * kMs;
  task.criticality = Criticality::high;
  plan.tasks.push_back(task);
  RunBoard board(plan);
  MonotonicClock clock;
  JobWatch watch;
  bool granted = false;
  int policy = 0;
  std::thread([&] {
    granted = apply(fixed_reservation(kHighestPriority)).refused.empty();
    if (!granted) return;
    Reservation never = deadline_reservation(task.budget_ns, task.deadline_ns, task.rate->period_ns());
    never.runtime_ns = 2 * never.deadline_ns;  // no kernel grants that
    watch.bind_beside(never, /*behind=*/false);
    Watchdog::Options options;
    options.granted = Policy::deadline;
    options.heartbeat_period_ns = kMs;
    LifeSigns life;
    options.life = &life;
    const Watchdog watchdog(plan, board, clock, {{&watch, {0}}}, options);
    for (int job = 0; job < 4; ++job) {
      watch.begin(0, static_cast<uint64_t>(job), clock.now_ns(), INT64_MAX);
      watch.end();
    }
    policy = own_policy();
    apply_default();  // a real-time thread that waits would be throttled before an ordinary one that is to tell it
    while (board.faults().size() == 0) std::this_thread::yield();
  }).join();
  if (!granted) {
    MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
    return;
  }
  CHECK(policy == SCHED_FIFO);
  CHECK(watch.refusals() == 5);
  REQUIRE(board.faults().size() == 2);
  CHECK(board.faults().at(0)->kind == Fault::bandwidth);
  CHECK(std::string(board.faults().at(0)->what.text()).find("guard: its reservation is not free") == 0);
  CHECK(std::string(board.faults().at(1)->what.text()) ==
        "guard: it never had its reservation again; it was refused 5 times");
}
