// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/simulate.hpp"

#include "sets.hpp"

using namespace takt::analysis;

namespace {

TaskSet simulated_set(std::vector<TimedTask> tasks, int cores = 1) {
  TaskSet set;
  set.tasks = std::move(tasks);
  set.cores = cores;
  for (TimedTask& task : set.tasks) task.core = 0;
  return set;
}

std::vector<std::vector<Arrival>> all_periodic(const TaskSet& set, Ticks end) {
  std::vector<std::vector<Arrival>> arrivals;
  for (const TimedTask& task : set.tasks) arrivals.push_back(periodic_arrivals(task, end));
  return arrivals;
}

/// Jobs as "task.number start-finish", in the order of starts.
std::string story(std::vector<SimulatedJob> jobs) {
  std::stable_sort(jobs.begin(), jobs.end(), [](const auto& a, const auto& b) { return a.start < b.start; });
  std::string text;
  for (const SimulatedJob& job : jobs) {
    text += std::string(1, static_cast<char>('a' + job.task)) + std::to_string(job.number) + " " +
            std::to_string(job.start) + "-" + std::to_string(job.finish) +
            (job.preemptions > 0 ? "!" + std::to_string(job.preemptions) : "") + (job.late() ? " late" : "") + "; ";
  }
  return text;
}

}  // namespace

TEST_CASE("rate monotonic: (2, 5) and (4, 7) miss at 7; EDF runs the second through and misses nothing") {
  const TaskSet set = simulated_set(tasks_of({{2, 5, 5}, {4, 7, 7}}));
  const auto arrivals = all_periodic(set, 14);
  CHECK(story(simulate(set, Dispatch::fixed_priority, arrivals)) ==
        "a0 0-2; b0 2-8!1 late; a1 5-7; b1 8-14!1; a2 10-12; ");
  CHECK(story(simulate(set, Dispatch::edf, arrivals)) == "a0 0-2; b0 2-6; a1 6-8; b1 8-12; a2 12-14; ");
}

TEST_CASE("non-preemptive EDF: what has started finishes, then the earliest deadline") {
  const TaskSet set = simulated_set(tasks_of({{2, 5, 10}, {3, 9, 10, 1}, {6, 20, 20, 0}}, false));
  std::vector<std::vector<Arrival>> arrivals = {{{1, 1}, {11, 12}}, {{1, 1}}, {{0, 0}}};
  CHECK(story(simulate(set, Dispatch::non_preemptive_edf, arrivals)) ==
        "c0 0-6; a0 6-8 late; b0 8-11 late; a1 12-14; ");
  CHECK(story(simulate(set, Dispatch::edf, arrivals)) == "c0 0-11!1; a0 1-3; b0 3-6; a1 12-14; ");
}

TEST_CASE("one task that is not to be preempted among others that are") {
  const TaskSet set = simulated_set(tasks_of({{1, 5, 10}, {4, 20, 20}}));
  Simulator simulator(set, Dispatch::fixed_priority);
  simulator.make_non_preemptable(1);
  simulator.add(1, 0, 0);
  simulator.add(0, 1, 1);
  simulator.run();
  CHECK(story(simulator.jobs()) == "b0 0-4; a0 4-5; ");
}

TEST_CASE("a job in parts keeps its core between them, and gives it up behind the last") {
  const TaskSet set = simulated_set(tasks_of({{1, 5, 10}, {4, 20, 20}}));
  SimulationHooks hooks;
  Simulator* simulated = nullptr;
  hooks.finished = [&](const SimulatedJob& job) {
    if (job.task == 1 && job.number < 2) simulated->add_next_part(job, 0);
    else if (job.task == 1 && job.number == 2) simulated->add(1, 0, 12);
  };
  Simulator simulator(set, Dispatch::global_edf, hooks);
  simulated = &simulator;
  simulator.make_non_preemptable(1);
  simulator.add(1, 0, 0);
  simulator.add(0, 1, 1);
  simulator.add(0, 2, 2);
  simulator.run();
  CHECK(story(simulator.jobs()) == "b0 0-4; b1 4-8; b2 8-12; a0 12-13 late; a1 13-14 late; b3 14-18; ");
}

TEST_CASE("global EDF: Dhall's effect on two cores") {
  // Dhall & Liu 1978: two light tasks and one heavy task, utilisation little above 1, miss on two cores
  const TaskSet set = simulated_set(tasks_of({{2, 10, 10}, {2, 10, 10}, {10, 11, 11}}), 2);
  const auto jobs = simulate(set, Dispatch::global_edf, {{{0, 0}}, {{0, 0}}, {{0, 0}}});
  CHECK(story(jobs) == "a0 0-2; b0 0-2; c0 2-12 late; ");
  CHECK(jobs[0].core == 0);
  CHECK(jobs[1].core == 1);
}

TEST_CASE("global EDF: a job that is preempted goes on where there is room, jobs of a task one after another") {
  const TaskSet set = simulated_set(tasks_of({{3, 4, 10}, {3, 4, 10}, {5, 20, 20}}), 2);
  const auto jobs = simulate(set, Dispatch::global_edf, {{{1, 1}}, {{1, 1}}, {{0, 0}, {2, 2}}});
  CHECK(story(jobs) == "c0 0-8!1; a0 1-4; b0 1-4; c1 8-13; ");
  CHECK(jobs[2].core == 0);
}

TEST_CASE("cores are served apart, each with its own tasks") {
  TaskSet set = simulated_set(tasks_of({{4, 10, 10}, {4, 10, 10}, {2, 10, 10}}), 2);
  set.tasks[1].core = 1;
  const auto jobs = simulate(set, Dispatch::fixed_priority, all_periodic(set, 10));
  CHECK(story(jobs) == "a0 0-4; b0 0-4; c0 4-6; ");
  CHECK(jobs[1].core == 1);
}

TEST_CASE("ties: the larger priority, then the earlier task") {
  TaskSet set = simulated_set(tasks_of({{1, 5, 5}, {1, 5, 5}, {1, 5, 5}}));
  for (TimedTask& task : set.tasks) task.priority = 0;
  set.tasks[2].priority = 1;
  CHECK(story(simulate(set, Dispatch::edf, {{{0, 0}}, {{0, 0}}, {{0, 0}}})) == "c0 0-1; a0 1-2; b0 2-3; ");
}

TEST_CASE("durations are asked once, at the start; a finished job may release another at once") {
  const TaskSet set = simulated_set(tasks_of({{5, 10, 10}, {5, 10, 10}}));
  int asked = 0;
  Simulator* running = nullptr;
  SimulationHooks hooks;
  hooks.duration = [&](const SimulatedJob& job) {
    ++asked;
    CHECK(job.start == running->now());
    return job.task == 0 ? Ticks{3} : Ticks{0};
  };
  hooks.finished = [&](const SimulatedJob& job) {
    if (job.task == 0) running->add(1, job.finish, job.finish);
  };
  Simulator simulator(set, Dispatch::fixed_priority, hooks);
  running = &simulator;
  simulator.add(0, 0, 0);
  simulator.add(0, 10, 11);
  simulator.run_until(3);
  CHECK(simulator.now() == 3);
  CHECK(story({simulator.jobs()[0], simulator.jobs()[2]}) == "a0 0-3; b0 3-3; ");
  simulator.run();
  CHECK(asked == 4);
  CHECK(simulator.jobs()[1].response() == 4);
  CHECK(simulator.jobs()[3].start == 14);
}
