// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/virtual_run.hpp"

#include <algorithm>
#include <utility>

#include "rt/sched/lane_tasks.hpp"

namespace takt {
namespace {

/// The lanes as the simulator knows them, one tick being 1 ns. Releases and durations are told as they come.
analysis::TaskSet task_set(const Plan& plan) {
  const std::vector<std::vector<size_t>> lanes = lane_members(plan);
  const std::vector<Reservation> reserved = reservations(plan, plan.policy);
  analysis::TaskSet set;
  set.cores = static_cast<int>(plan.cores.empty() ? lanes.size() : plan.cores.size());
  for (size_t i = 0; i < lanes.size(); ++i) {
    analysis::TimedTask task;
    task.name = plan.tasks[lanes[i].front()].name;
    task.deadline = plan.policy == Policy::deadline ? reserved[i].deadline_ns : lane_span_ns(plan, lanes[i]);
    if (plan.policy == Policy::fixed) {
      const auto core = std::find(plan.cores.begin(), plan.cores.end(), reserved[i].core);
      task.core = static_cast<int>(plan.cores.empty() ? static_cast<ptrdiff_t>(i) : core - plan.cores.begin());
      task.priority = reserved[i].priority;
    }
    set.tasks.push_back(std::move(task));
  }
  return set;
}

/// Number of the imagined thread of a lane.
int32_t thread_of(size_t lane) { return static_cast<int32_t>(lane + 1); }

analysis::Dispatch dispatch_of(Policy policy) {
  return policy == Policy::fixed ? analysis::Dispatch::fixed_priority : analysis::Dispatch::global_edf;
}

}  // namespace

VirtualRun::VirtualRun(const Plan& plan, const std::vector<std::unique_ptr<Lane>>& lanes, VirtualClock& clock,
                       StopSignal& stop, Options options)
    : plan_(plan),
      clock_(clock),
      stop_(stop),
      options_(std::move(options)),
      simulator_(
          task_set(plan), dispatch_of(plan.policy),
          {[this](const analysis::SimulatedJob& job) { return begin(job); },
           [this](const analysis::SimulatedJob& job) { finish(job); },
           [this](const analysis::SimulatedJob& job, int64_t from, int64_t to) { tell_stretch(job, from, to); }}) {
  for (const auto& lane : lanes) {
    const auto number = thread_of(courses_.size());
    trace::Ring* ring = options_.trace != nullptr ? options_.trace->claim(lane->head().plan().name, number) : nullptr;
    courses_.push_back({lane.get(), ring});
    if (plan_.policy == Policy::cooperative) simulator_.make_non_preemptable(courses_.size() - 1);
  }
}

void VirtualRun::run() {
  for (size_t lane = 0; lane < courses_.size(); ++lane) expect_head(lane);
  simulator_.run();
}

void VirtualRun::expect_head(size_t lane) {
  Course& course = courses_[lane];
  const int64_t release = course.lane->next_release_ns();
  if (release >= stop_.end_ns()) return;
  course.job = {0, release};
  add(lane, release);
}

void VirtualRun::expect_follower(const analysis::SimulatedJob& before) {
  Course& course = courses_[before.task];
  // In the order of the lane, whoever released them.
  std::vector<Lane::Activation>& waiting = course.waiting;
  const auto next = std::min_element(waiting.begin(), waiting.end(),
                                     [](const auto& a, const auto& b) { return a.member < b.member; });
  course.job = *next;
  waiting.erase(next);
  if (plan_.policy != Policy::cooperative) return add(before.task, course.job.release_ns);
  course.asleep = course.job.release_ns > clock_.now_ns();
  simulator_.add_next_part(before, course.lane->next_release_ns());
}

void VirtualRun::add(size_t lane, int64_t ready_ns) {
  // A pass is due as a whole, counted from the release of its head.
  simulator_.add(lane, courses_[lane].lane->next_release_ns(), std::max(ready_ns, clock_.now_ns()));
}

analysis::Ticks VirtualRun::begin(const analysis::SimulatedJob& simulated) {
  Course& course = courses_[simulated.task];
  clock_.advance_to(simulator_.now());
  if (course.asleep) return course.job.release_ns - clock_.now_ns();
  course.dropped = course.job.member == 0 && course.job.release_ns >= stop_.end_ns();
  if (course.dropped) return 0;
  const size_t task = course.lane->members()[course.job.member];
  const trace::As traced(course.ring);
  const int64_t needed = course.lane->begin(
      course.job, options_.duration_ns ? options_.duration_ns(task, course.lane->index(course.job.member))
                                       : plan_.tasks[task].budget_ns);
  if (options_.after_step) options_.after_step();
  return needed;
}

void VirtualRun::finish(const analysis::SimulatedJob& simulated) {
  Course& course = courses_[simulated.task];
  if (course.dropped) return;
  clock_.advance_to(simulator_.now());
  if (std::exchange(course.asleep, false)) return simulator_.add_next_part(simulated, course.lane->next_release_ns());
  const trace::As traced(course.ring);
  released_.clear();
  const JobEnd end = course.lane->finish(course.job, core_of(simulated), released_);
  if (options_.after_step) options_.after_step();
  if (end.end_of_data) return stop_.raise(course.job.release_ns);
  course.waiting.insert(course.waiting.end(), released_.begin(), released_.end());
  if (!course.waiting.empty()) return expect_follower(simulated);
  course.lane->go_on(clock_.now_ns(), stop_.end_ns());
  expect_head(simulated.task);
}

int VirtualRun::core_of(const analysis::SimulatedJob& job) const {
  return plan_.cores.empty() ? job.core : plan_.cores[static_cast<size_t>(job.core)];
}

void VirtualRun::tell_stretch(const analysis::SimulatedJob& job, int64_t from_ns, int64_t to_ns) const {
  if (!options_.ran || from_ns == to_ns || courses_[job.task].asleep) return;
  trace::Slice slice;
  slice.from_ns = from_ns;
  slice.to_ns = to_ns;
  if (from_ns == job.start) slice.woken_ns = job.ready;
  slice.thread = thread_of(job.task);
  slice.cpu = core_of(job);
  slice.end = job.finish == to_ns ? trace::Slice::End::asleep : trace::Slice::End::preempted;
  options_.ran(slice);
}

}  // namespace takt
