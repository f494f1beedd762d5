// SPDX-License-Identifier: Apache-2.0
#include "graph/check/admission.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "graph/check/check.hpp"
#include "graph/check/margins.hpp"
#include "plans.hpp"
#include "rt/sched/lane_tasks.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

Answer answer(const Plan& plan, const analysis::Overheads& o = {}) { return admit(plan, o, false).answer; }

bool says(const Admission& admission, const std::string& words) {
  for (const auto& reason : admission.reasons)
    if (reason.find(words) != std::string::npos) return true;
  return false;
}

Plan random_plan(std::mt19937& random) {
  const auto uniform = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  constexpr int kRates[] = {15, 10, 7, 5, 2};
  Plan plan = plan_of(static_cast<Policy>(uniform(0, 1)), {0, 1}, {});
  for (int i = 0, n = uniform(3, 8); i < n; ++i) {
    const int hz = kRates[uniform(0, 4)];
    const double period = 1000.0 / hz, budget = period * uniform(1, 30) / 100;
    plan.tasks.push_back(task("n" + std::to_string(i), hz, budget, budget + (period - budget) * uniform(1, 10) / 10,
                              uniform(0, 1) == 0 ? Criticality::low : Criticality::high));
    plan.tasks.back().offset_ns = uniform(0, 40) * kMs;
  }
  return plan;
}

}  // namespace

TEST_CASE("admission: each policy has its analysis") {
  const std::vector<TaskPlan> tasks{task("a", 10, 20, 50), task("b", 10, 20, 60), task("c", 5, 50, 200)};
  for (const Policy policy : {Policy::deadline, Policy::fixed, Policy::cooperative}) {
    const Admission one = admit(plan_of(policy, {0}, tasks), {});
    CAPTURE(to_string(policy));
    CAPTURE(one.by);
    CHECK(one.answer == Answer::admitted);
  }
  Plan shifted = plan_of(Policy::cooperative, {0}, tasks);
  shifted.tasks[2].offset_ns = 90 * kMs;  // a has to wait until 140, as nothing is preempted, and is due at 150
  CHECK(answer(shifted) == Answer::not_proven);
  shifted.cores = {0, 1};
  CHECK(answer(shifted) == Answer::admitted);
  const Admission fixed = admit(plan_of(Policy::fixed, {0}, tasks), {});
  CHECK(fixed.nodes[0].response_ns == 20 * kMs);
  CHECK(fixed.nodes[1].response_ns == 40 * kMs);
  CHECK(fixed.nodes[2].response_ns == 90 * kMs);
}

TEST_CASE("admission: under deadline a job has the deadline of its reservation") {
  Plan plan = plan_of(Policy::deadline, {0}, {task("a", 10, 95, 100)});
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[0].budget_ns = 96 * kMs;  // the reservation ends at 95
  CHECK(answer(plan) == Answer::infeasible);
}

TEST_CASE("admission: the kernel's own limit counts budgets over deadlines") {
  Plan plan = plan_of(Policy::deadline, {0, 1}, {task("a", 2, 50, 100), task("b", 2, 60, 100), task("c", 2, 70, 100)});
  CHECK(answer(plan) == Answer::not_proven);
  plan.tasks[2].budget_ns = 30 * kMs;
  CHECK(answer(plan) == Answer::admitted);
  analysis::Overheads kernel;
  kernel.deadline_bandwidth = 1.40;
  CHECK(answer(plan, kernel) == Answer::admitted);
  kernel.deadline_bandwidth = 1.39;
  CHECK(says(admit(plan, kernel), "the reservations add up to 1.400 cores"));
}

TEST_CASE("admission: overheads are charged to every job") {
  Plan plan = plan_of(Policy::fixed, {0}, {task("a", 10, 99.98, 100)});
  CHECK(answer(plan) == Answer::admitted);
  analysis::Overheads o;
  o.release_ns = 10'000;
  o.switch_ns = 5'000;
  CHECK(answer(plan, o) == Answer::admitted);
  o.switch_ns = 5'001;
  CHECK(answer(plan, o) == Answer::infeasible);
}

TEST_CASE("admission: members of a lane have their own deadlines") {
  Plan plan =
      plan_of(Policy::fixed, {0}, {task("head", 10, 10, 20), task("middle", 10, 20, 30), task("tail", 10, 5, 25)});
  follow(plan, 1, 0);
  follow(plan, 2, 0);  // runs after `middle`, on the same thread
  const Admission found = admit(plan, {});
  CHECK(found.answer == Answer::admitted);
  CHECK(found.nodes[0].response_ns == 10 * kMs);
  CHECK(found.nodes[1].response_ns == 20 * kMs);
  CHECK(found.nodes[1].finish_ns == 30 * kMs);
  CHECK(found.nodes[2].response_ns == 25 * kMs);
  CHECK(found.nodes[2].finish_ns == 35 * kMs);
  plan.tasks[2].deadline_ns = 24 * kMs;
  CHECK(says(admit(plan, {}), "tail: its deadline of 24 ms is not proven"));
}

TEST_CASE("admission: while a lane waits for an instant others run under fixed") {
  Plan plan =
      plan_of(Policy::fixed, {0}, {task("head", 10, 10, 40), task("tail", 10, 10, 30), task("other", 10, 50, 70)});
  follow(plan, 1, 0);
  CHECK(admit(plan, {}).nodes[2].response_ns == 70 * kMs);
  plan.tasks[0].publish = PublishAt::let;  // tail begins at 40, in the midst of other
  Admission found = admit(plan, {});
  CHECK(found.answer == Answer::admitted);
  CHECK(found.nodes[0].response_ns == 10 * kMs);
  CHECK(found.nodes[1].response_ns == 10 * kMs);
  CHECK(found.nodes[1].finish_ns == 50 * kMs);
  CHECK(found.nodes[2].response_ns == 70 * kMs);
  plan.tasks[2].budget_ns = 51 * kMs;
  CHECK(says(admit(plan, {}), "other may take 71.000 ms"));
  plan.tasks[2].budget_ns = 29 * kMs;  // just done
  CHECK(admit(plan, {}).nodes[2].response_ns == 39 * kMs);
}

TEST_CASE("admission: under cooperative a worker is occupied by waiting") {
  Plan plan = plan_of(Policy::cooperative, {0},
                      {task("head", 10, 10, 40), task("tail", 10, 10, 30), task("other", 10, 50, 100)});
  follow(plan, 1, 0);
  CHECK(admit(plan, {}).nodes[2].response_ns == 70 * kMs);
  plan.tasks[0].publish = PublishAt::let;
  const Admission found = admit(plan, {});
  CHECK(found.answer == Answer::admitted);
  CHECK(found.nodes[1].response_ns == 10 * kMs);  // whenever the head had begun
  CHECK(found.nodes[2].response_ns == 100 * kMs);
  plan.tasks[2].budget_ns += 1;
  CHECK(answer(plan) != Answer::admitted);
}

TEST_CASE("admission: a worker that waits gets no deadline from the kernel that could be relied on") {
  Plan plan = plan_of(Policy::deadline, {0}, {task("head", 10, 10, 40), task("tail", 10, 10, 30)});
  follow(plan, 1, 0);
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[0].publish = PublishAt::let;
  CHECK(answer(plan) == Answer::not_proven);
  CHECK(says(admit(plan, {}), "give tail a `rate`"));
  plan.tasks[1].rate = plan.tasks[0].rate;  // as it is told
  plan.tasks[1].on_task = kNone;
  plan.tasks[1].offset_ns = plan.tasks[0].deadline_ns;
  CHECK(answer(plan) == Answer::admitted);
}

TEST_CASE("admission: a device that sleeps for its data has less time for its work, and its work comes later") {
  // Up to 20 ms of sleep, then 5 of work; below it 10 of work, whose release it may come to delay.
  Plan plan = plan_of(Policy::fixed, {0}, {task("camera", 10, 5, 40), task("other", 10, 10, 60)});
  plan.tasks[0].device = true;
  plan.tasks[0].source.wait_ns = 20 * kMs;
  plan.tasks[1].offset_ns = 15 * kMs;
  const Admission fixed = admit(plan, {});
  CHECK(fixed.answer == Answer::admitted);
  CHECK(fixed.nodes[0].response_ns == 25 * kMs);
  CHECK(fixed.nodes[1].response_ns == 15 * kMs);  // without the sleep nobody would be in its way
  analysis::Overheads woken;
  woken.release_ns = kMs;
  CHECK(admit(plan, woken).nodes[0].response_ns == 27 * kMs);  // for its job, and for its data
  CHECK(answer(plan_of(Policy::cooperative, {0}, plan.tasks)) == Answer::admitted);
  // What the kernel is asked for is what is left of the deadline when the thread wakes up.
  const Plan reserved = plan_of(Policy::deadline, {0}, plan.tasks);
  CHECK(reservations(reserved, Policy::deadline)[0].deadline_ns == 20 * kMs);
  const Admission deadline = admit(reserved, {});
  CHECK(deadline.answer == Answer::admitted);
  CHECK(*deadline.nodes[0].response_ns >= 25 * kMs);
  CHECK(*deadline.nodes[0].response_ns <= 40 * kMs);
  for (const Policy policy : {Policy::fixed, Policy::deadline, Policy::cooperative}) {
    CAPTURE(to_string(policy));
    Plan late = plan_of(policy, {0}, plan.tasks);
    late.tasks[0].source.wait_ns = 36 * kMs;
    const Admission refused = admit(late, {});
    CHECK(refused.answer == Answer::not_proven);
    CHECK(says(refused, "camera: what it asked for may come 36.000 ms after its release"));
  }
}

TEST_CASE("admission: who follows each second message is in each second job") {
  for (const Policy policy : {Policy::fixed, Policy::deadline, Policy::cooperative}) {
    CAPTURE(to_string(policy));
    Plan plan = plan_of(policy, {0}, {task("often", 10, 20, 50), task("seldom", 10, 40, 50), task("slow", 5, 60, 200)});
    follow(plan, 1, 0);
    plan.tasks[1].every = 2;  // of 200 ms 20 + 40 + 20 are used, wherever the 40 fall
    plan.tasks[2].offset_ns = 30 * kMs;
    const Admission found = admit(plan, {});
    REQUIRE(found.answer == Answer::admitted);
    CHECK(found.nodes[1].response_ns == 40 * kMs);
    // Released at 30, behind the seldom one until 60, and from 100 on behind the often one if that may interrupt it.
    CHECK(found.nodes[2].response_ns == (policy == Policy::cooperative ? 90 * kMs : 110 * kMs));
  }
}

TEST_CASE("admission: a low node that is stopped late must not make a high one late") {
  // Behind the guard, noise would not be done after 8.
  Plan plan = plan_of(Policy::fixed, {0}, {task("noise", 10, 5, 8, Criticality::low), task("guard", 10, 5, 20)});
  analysis::Overheads o;
  constexpr int64_t kGrain = 100'000;  // the watchdog looks no more often
  o.enforcement_ns = 30 * kMs;         // that of the other policy
  o.demotion_ns = 10 * kMs - kGrain;
  CHECK(answer(plan, o) == Answer::admitted);
  o.demotion_ns = 11 * kMs - kGrain;
  CHECK(says(admit(plan, o), "running on to 11.0 ms over its budget"));
  plan.tasks[0].criticality = Criticality::high;  // nobody to be guarded against
  CHECK(answer(plan, o) == Answer::admitted);
  plan.tasks[0].criticality = Criticality::low;
  plan.tasks[0].deadline_ns = 10 * kMs;  // now it may come second
  CHECK(answer(plan, o) == Answer::admitted);
  plan.policy = Policy::deadline;
  plan.cores = {0, 1};
  o.enforcement_ns = 5 * kMs;
  CHECK(answer(plan, o) == Answer::admitted);
  o.enforcement_ns = 40 * kMs;
  CHECK(answer(plan, o) == Answer::not_proven);
}

TEST_CASE("admission: fixed priorities are spread over the cores so that each fits") {
  // By load alone the third would go beside the first.
  const Plan plan = plan_of(Policy::fixed, {3, 5}, {task("a", 10, 5, 10), task("b", 10, 7, 11), task("c", 10, 8, 12)});
  CHECK(answer(plan) != Answer::admitted);  // no two of the three fit on one core
  const Plan fits = plan_of(Policy::fixed, {3, 5},
                            {task("a", 10, 5, 10), task("b", 10, 7, 11), task("c", 10, 3, 12), task("d", 10, 40, 100)});
  CHECK(answer(fits) == Answer::admitted);
  const std::vector<Reservation> asked = reservations(fits, Policy::fixed);
  CHECK(asked[0].core == 5);
  CHECK(asked[1].core == 3);                         // first, since its deadline leaves the least
  CHECK(asked[0].priority == kHighestPriority - 1);  // each core counts from the top
  CHECK(asked[1].priority == kHighestPriority - 1);
}

TEST_CASE("admission: under fixed lanes of high criticality go first unless that makes others late") {
  Plan plan = plan_of(Policy::fixed, {0},
                      {task("low", 10, 5, 20, Criticality::low), task("quick", 10, 5, 30, Criticality::low),
                       task("guard", 10, 5, 40), task("stop", 10, 5, 35)});
  const auto order = [&] {
    const std::vector<Reservation> asked = reservations(plan, Policy::fixed);
    std::vector<size_t> tasks{0, 1, 2, 3};
    std::sort(tasks.begin(), tasks.end(), [&](size_t a, size_t b) { return asked[a].priority > asked[b].priority; });
    return tasks;
  };
  CHECK(order() == std::vector<size_t>{3, 2, 0, 1});
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[0].deadline_ns = 14 * kMs;  // behind both it is done after 15
  CHECK(order() == std::vector<size_t>{0, 1, 3, 2});
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[1].budget_ns = 90 * kMs;  // nothing is met in either order
  CHECK(order() == std::vector<size_t>{3, 2, 0, 1});
  CHECK(answer(plan) == Answer::infeasible);
  plan.tasks[1].budget_ns = 5 * kMs;
  follow(plan, 3, 0);  // one high member makes its lane one
  CHECK(reservations(plan, Policy::fixed).size() == 3);
  CHECK(reservations(plan, Policy::fixed)[0].priority > reservations(plan, Policy::fixed)[1].priority);
}

TEST_CASE("admission: under fixed each lane has a priority for its watchdog above it, and a core has room for 39") {
  std::vector<TaskPlan> tasks;
  for (int i = 0; i < 39; ++i) tasks.push_back(task(("t" + std::to_string(i)).c_str(), 10, 1, 60 + i));
  Plan plan = plan_of(Policy::fixed, {0}, tasks);
  const auto priorities = [&] {
    std::vector<int> all;
    for (const Reservation& asked : reservations(plan, Policy::fixed)) all.push_back(asked.priority);
    return all;
  };
  CHECK(priorities().front() == kHighestPriority - 1);
  CHECK(priorities()[1] == kHighestPriority - 3);
  CHECK(priorities().back() == kLowestPriority + 2);
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks.push_back(task("one more", 10, 1, 99));
  CHECK(priorities().back() == kLowestPriority + 2);
  CHECK(answer(plan) == Answer::infeasible);
  CHECK(says(admit(plan, {}), "40 lanes share a core, and `fixed` has priorities for 39"));
  plan.cores = {0, 1};
  CHECK(answer(plan) == Answer::admitted);
}

TEST_CASE("admission: under fixed looks of a watchdog are charged to whom they may delay") {
  Plan plan = plan_of(Policy::fixed, {0},
                      {task("guard", 10, 20, 50), task("noise", 10, 10, 100, Criticality::low),
                       task("late", 10, 10, 100, Criticality::low)});
  plan.tasks[2].deadline_ns -= 1;
  const Admission without = admit(plan, {});
  REQUIRE(without.answer == Answer::admitted);
  analysis::Overheads o;
  o.look_ns = 1'000;
  const Admission with = admit(plan, o);
  REQUIRE(with.answer == Answer::admitted);
  const auto more_ns = [&](size_t t) { return *with.nodes[t].response_ns - *without.nodes[t].response_ns; };
  // The guard: the timers of two lanes below it, and twice the process's watchdog.
  CHECK(more_ns(0) == 2'000 + 2'000);
  // Behind it comes the one with the shorter deadline: four looks, one for the guard's preemption, and one for the
  // looks of the process's watchdog, which take little of a grain.
  const int64_t late = 4 + 1 + 1;
  CHECK(more_ns(2) == (late + 2 + 1) * 1'000);
  CHECK(more_ns(1) == (late + 4 + 1 + 1 + 1 + 2) * 1'000);
  plan.policy = Policy::deadline;  // its watchdog goes behind all reservations
  CHECK(*admit(plan, o).nodes[0].response_ns == *admit(plan, {}).nodes[0].response_ns);
}

TEST_CASE("admission: under fixed who goes behind a longer lead than his own is charged the rest of it") {
  Plan plan = plan_of(Policy::fixed, {0}, {task("guard", 10, 5, 40), task("low", 10, 5, 20, Criticality::low)});
  plan.anticipate_ns = 2 * kMs;  // at most a twentieth of the deadline: 2 and 1 ms
  const Admission admission = admit(plan, {});
  REQUIRE(admission.answer == Answer::admitted);
  CHECK(admission.nodes[0].response_ns == 7 * kMs);
  CHECK(admission.nodes[1].response_ns == 14 * kMs);  // 7 of the guard, 6 of its own, 1 for the guard's being early
  plan.tasks[0].criticality = Criticality::low;       // deadline monotonic
  CHECK(admit(plan, {}).nodes[0].response_ns == 13 * kMs);
  CHECK(admit(plan, {}).nodes[1].response_ns == 6 * kMs);
}

TEST_CASE("admission: only a lane with a high-criticality member goes on beyond its reservation") {
  Plan plan = plan_of(Policy::deadline, {0, 1}, {task("a", 10, 5, 50), task("b", 10, 5, 50)});
  plan.tasks[0].criticality = Criticality::high;
  plan.tasks[1].criticality = Criticality::low;
  CHECK(reservations(plan, Policy::deadline)[0].reclaims);
  CHECK(!reservations(plan, Policy::deadline)[1].reclaims);
  CHECK(!reservations(plan, Policy::fixed)[0].reclaims);
}

TEST_CASE("admission: being awake before a release costs what it may cost at most") {
  Plan plan = plan_of(Policy::fixed, {0, 1}, {task("a", 10, 5, 50), task("b", 100, 1, 2)});
  plan.anticipate_ns = 200'000;
  const auto budget = [&](Policy policy, size_t lane) { return lane_tasks(plan, policy, {}).set.tasks[lane].budget; };
  const auto deadline = [&](Policy policy, size_t lane) {
    return lane_tasks(plan, policy, {}).set.tasks[lane].deadline;
  };
  CHECK(budget(Policy::fixed, 0) == 5 * kMs + 200'000);
  CHECK(deadline(Policy::fixed, 0) == 50 * kMs);
  CHECK(budget(Policy::fixed, 1) == 1 * kMs + 100'000);  // a twentieth of 2 ms
  CHECK(budget(Policy::deadline, 0) == 5 * kMs + 200'000);
  CHECK(deadline(Policy::deadline, 0) == 50 * kMs - 200'000);
  CHECK(budget(Policy::cooperative, 0) == 5 * kMs);
  CHECK(deadline(Policy::cooperative, 0) == 50 * kMs);
  CHECK(reservations(plan, Policy::deadline)[0].runtime_ns == 5 * kMs + 200'000);
  CHECK(reservations(plan, Policy::deadline)[0].deadline_ns == 50 * kMs);
  // Full to the last microsecond without it.
  Plan full = plan_of(Policy::fixed, {0}, {task("a", 10, 50, 100), task("b", 10, 50, 100)});
  CHECK(answer(full) == Answer::admitted);
  full.anticipate_ns = 1'000;
  CHECK(answer(full) != Answer::admitted);
}

TEST_CASE("admission: one percent below the margin is admitted, one above is refused") {
  std::mt19937 random(5);
  int seen = 0;
  for (int round = 0; round < 100; ++round) {
    CAPTURE(round);
    const Plan plan = random_plan(random);
    analysis::Overheads o;
    o.enforcement_ns = 4 * kMs;
    if (answer(plan, o) != Answer::admitted) continue;
    const std::vector<int64_t> found = margins(plan, o);
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      CAPTURE(t);
      Plan changed = plan;
      changed.tasks[t].budget_ns = plan.tasks[t].budget_ns + found[t] * 99 / 100;
      CHECK(answer(changed, o) == Answer::admitted);
      changed.tasks[t].budget_ns = plan.tasks[t].budget_ns + found[t] * 101 / 100 + 2'000;
      CHECK(answer(changed, o) != Answer::admitted);
      ++seen;
    }
  }
  CHECK(seen > 150);
}

TEST_CASE("admission: the smallest change makes it fit, and is the smallest of its kind") {
  std::mt19937 random(6);
  int seen = 0;
  for (int round = 0; round < 150; ++round) {
    CAPTURE(round);
    const Plan plan = random_plan(random);
    if (answer(plan) == Answer::admitted) continue;
    const auto change = smallest_change(plan, {});
    if (!change) continue;
    ++seen;
    CAPTURE(to_string(*change, plan));
    const auto with = [&](double share) {  // `share` of the change
      Plan changed = plan;
      const double value = change->from + share * (change->to - change->from);
      switch (change->what) {
        case Change::What::budget: changed.tasks[change->task].budget_ns = static_cast<int64_t>(value * 1e6); break;
        case Change::What::deadline:
          changed.tasks[change->task].deadline_ns = static_cast<int64_t>(value * 1e6 + 0.5);
          break;
        case Change::What::rate:
          changed.tasks[change->task].rate = Rate{static_cast<int64_t>(value * 10 + 0.5), 10};
          break;
        case Change::What::cores: changed.cores.resize(static_cast<size_t>(value), 7); break;
        case Change::What::offset:
        case Change::What::max_age: FAIL("admission does not ask for ages"); break;
      }
      return answer(changed);
    };
    CHECK(with(1) == Answer::admitted);
    if (change->what == Change::What::budget || change->what == Change::What::deadline)
      CHECK(with(0.99) != Answer::admitted);
  }
  CHECK(seen > 15);
}

TEST_CASE("admission: under deadline a high node that runs on takes its budget every reservation period") {
  // Once in 100 ms that leaves room, every 10 ms it does not.
  Plan plan = plan_of(Policy::deadline, {0}, {task("fast", 10, 5, 10), task("slow", 10, 12, 40)});
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[1].budget_ns = 24 * kMs;
  CHECK(says(admit(plan, {}), "and one of high running on to 0.0 ms over its budget"));
  plan.tasks[1].budget_ns = 12 * kMs;
  analysis::Overheads o;
  o.enforcement_ns = 3 * kMs;
  CHECK(answer(plan, o) == Answer::admitted);
  o.enforcement_ns = 6 * kMs;
  CHECK(says(admit(plan, o), "running on to 6.0 ms"));
}

TEST_CASE("admission: a node has the core that the schedule names, and others go where they fit") {
  Plan plan = plan_of(Policy::fixed, {3, 5}, {task("a", 10, 5, 10), task("b", 10, 6, 11), task("c", 10, 40, 100)});
  plan.tasks[0].core = 5;
  std::vector<Reservation> asked = reservations(plan, Policy::fixed);
  CHECK(asked[0].core == 5);
  CHECK(asked[1].core == 3);
  plan.tasks[1].core = 5;
  asked = reservations(plan, Policy::fixed);
  CHECK(asked[1].core == 5);
  CHECK(asked[2].core == 3);
  CHECK(answer(plan) == Answer::admitted);
  plan.tasks[1].budget_ns = 7 * kMs;
  CHECK(says(admit(plan, {}), "b may take 12.000 ms from its release and has 11.000 ms"));
  // Overheads decide as well where a lane fits: by its work on 3, where it is done at 58.
  plan = plan_of(Policy::fixed, {3, 5}, {task("a", 10, 50, 50), task("b", 10, 60, 100), task("c", 10, 8, 58)});
  plan.tasks[0].core = 3;
  plan.tasks[1].core = 5;
  CHECK(reservations(plan, Policy::fixed)[2].core == 3);
  plan.tasks[0].deadline_ns = 55 * kMs;
  plan.overheads.release_ns = kMs;
  CHECK(reservations(plan, Policy::fixed)[2].core == 5);
}

TEST_CASE("check: a change of mode and the bandwidth of a dead process have bounds") {
  Plan plan = plan_of(Policy::deadline, {0, 1}, {task("a", 10, 20, 50), task("b", 2, 20, 450)});
  plan.modes = {{"full", {1, 1}}, {"short", {1, 0}}};
  const CheckResult found = check({}, plan);
  REQUIRE(found.modes.size() == 2);
  CHECK(found.modes[0].change_within_ns == (1 + 500) * kMs);
  CHECK(found.modes[1].change_within_ns == (1 + 450) * kMs);  // b's last job
  CHECK(found.json["modes"][1]["change_within_ms"] == 451);
  CHECK(found.bandwidth_within_ns == (450 + 5) * kMs);
  CHECK(found.json["bandwidth_within_ms"] == 455);
  plan.policy = Policy::fixed;
  CHECK(check({}, plan).bandwidth_within_ns == 0);
}

TEST_CASE("check: modes are checked as well, without what they leave out") {
  Plan plan = plan_of(Policy::deadline, {0}, {task("a", 10, 20, 50), task("b", 10, 20, 60), task("c", 10, 30, 90)});
  follow(plan, 1, 0);
  CHECK(without(plan, {"a"}).tasks.size() == 1);
  CHECK(without(plan, {"c"}).tasks[1].on_task == 0);
  plan.modes = {{"full", {1, 1, 1}}, {"short", {1, 1, 0}}};
  CheckOptions options;
  options.margins = true;
  const CheckResult result = check({}, plan, options);
  REQUIRE(result.modes.size() == 2);
  CHECK(result.modes[1].tasks == std::vector<std::string>{"a", "b"});
  CHECK(result.modes[1].margins_ns[0] > result.modes[0].margins_ns[0]);
  CHECK(result.json["modes"][1]["name"] == "short");
}

TEST_CASE("check: deadline on some of the cores needs an exclusive cpuset") {
  GraphSpec graph;
  graph.schedule.cores = {0};
  const Plan plan = plan_of(Policy::deadline, {0}, {task("a", 10, 20, 50)});
  CheckOptions options;
  CHECK(check(graph, plan, options).admitted);
  options.machine.online = {0, 1};
  const CheckResult refused = check(graph, plan, options);
  CHECK(refused.verdict == Verdict::invalid);
  CHECK(!refused.admitted);
  CHECK(refused.text.find("exclusive cpuset") != std::string::npos);
  CHECK(check({}, plan, options).admitted);  // no `cores` in the schedule: nothing to contradict
  options.machine.exclusive = {0};
  CHECK(check(graph, plan, options).admitted);
  options.machine.exclusive.clear();
  options.real_time = false;
  CHECK(check(graph, plan, options).admitted);
  options.real_time = true;
  Plan fixed = plan;
  fixed.policy = Policy::fixed;
  CHECK(check(graph, fixed, options).admitted);
}

TEST_CASE("check: lines stay within 80 columns, and every node has its bound and margin") {
  CheckOptions options;
  options.margins = true;
  const CheckResult result =
      check({}, plan_of(Policy::fixed, {0}, {task("object_detection", 10, 20.125, 50)}), options);
  size_t begin = 0;
  for (size_t end; (end = result.text.find('\n', begin)) != std::string::npos; begin = end + 1)
    CHECK(end - begin <= 80);
  const auto& node = result.json["nodes"][0];
  CHECK(node["response_ms"] == doctest::Approx(20.125));
  CHECK(node["margin_ms"] == doctest::Approx(29.875).epsilon(0.001));
}
