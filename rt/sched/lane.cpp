// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/lane.hpp"

#include <algorithm>
#include <stdexcept>

#include "rt/hot.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/sched/watch_rules.hpp"

namespace takt {

Lane::Lane(std::vector<size_t> members, const std::vector<std::unique_ptr<Task>>& tasks)
    : members_(std::move(members)), followers_(members_.size()), visible_(members_.size()), ran_(members_.size()) {
  for (const size_t index : members_) {
    tasks[index]->set_watch(*watch_, static_cast<uint32_t>(tasks_.size()));
    tasks_.push_back(tasks[index].get());
    span_ns_ += tasks_.back()->plan().deadline_ns;
  }
  if (members_.size() > 1) span_ns_ = std::min(span_ns_, rate().period_ns());
  for (size_t m = 1; m < members_.size(); ++m) {
    const auto producer = std::find(members_.begin(), members_.end(), tasks_[m]->plan().on_task);
    followers_[m].producer = static_cast<size_t>(producer - members_.begin());
    followers_[m].last_release_ns = std::numeric_limits<int64_t>::min() / 2;
  }
}

void Lane::join(int64_t epoch_ns, int64_t now_ns) {
  set_epoch(epoch_ns);
  go_to(rate().releases_before(origin_ns_, now_ns));
  for (size_t m = 1; m < tasks_.size(); ++m) followers_[m].index = tasks_[m]->statistics().released.load();
}

bool Lane::activates(size_t member, int64_t visible_at_ns) {
  const TaskPlan& plan = tasks_[member]->plan();
  Follower& follower = followers_[member];
  if (!tasks_[follower.producer]->published(plan.on_port)) return false;
  if (follower.publications++ % plan.every != 0) return false;
  if (visible_at_ns - follower.last_release_ns < plan.min_interval_ns) return false;
  follower.last_release_ns = visible_at_ns;
  tasks_[member]->statistics().released.fetch_add(1, std::memory_order_relaxed);
  return true;
}

TAKT_HOT void Lane::run_next(const Clock& clock, StopSignal& stop) {
  const int64_t release = next_release_ns();
  const JobEnd end = head().run(static_cast<uint64_t>(next_), release);
  if (end.end_of_data) {
    head().count(take_page_faults());
    stop.raise(release);
    return;
  }
  ran_[0] = true;
  visible_[0] = end.visible_at_ns;
  for (size_t m = 1; m < tasks_.size(); ++m) {
    const size_t producer = followers_[m].producer;
    ran_[m] = ran_[producer] && activates(m, visible_[producer]);
    if (!ran_[m]) continue;
    if (visible_[producer] > clock.now_ns()) {
      watch_->falls_asleep();
      stop.sleep_until(visible_[producer]);
      watch_->awakes();
    }
    visible_[m] = tasks_[m]->run(followers_[m].index++, visible_[producer]).visible_at_ns;
  }
  // Page faults are asked for once a pass and stand with its head: asking costs more than an empty job.
  for (size_t m = 0; m < tasks_.size(); ++m)
    if (ran_[m]) tasks_[m]->count(m == 0 ? take_page_faults() : 0);
  watch_->rest(last_thread_use_ns());
  go_on(clock.now_ns(), stop.end_ns());
}

TAKT_HOT void Lane::rehearse() const {
  for (const Task* task : tasks_) task->rehearse(next_release_ns_);
}

void Lane::go_on(int64_t now_ns, int64_t end_ns) {
  go_to(next_ + 1);
  skip_passed(now_ns, end_ns);
}

void Lane::skip_passed(int64_t now_ns, int64_t end_ns) {
  // `skip` drops every passed release; the other verbs leave one pending, so that a late job is followed at once.
  const int64_t pending = head().plan().on_miss == OnMiss::skip ? 0 : 1;
  const int64_t wanted = rate().releases_before(origin_ns_, now_ns + 1) - pending;
  if (wanted <= next_ || next_release_ns_ >= end_ns) return;
  const int64_t first = next_;
  go_to(std::min(wanted, rate().releases_before(origin_ns_, end_ns)));
  head().skip(first, next_, origin_ns_);
}

int64_t Lane::begin(const Activation& job, int64_t duration_ns) {
  return tasks_[job.member]->begin(index(job.member), job.release_ns, duration_ns);
}

JobEnd Lane::finish(const Activation& job, int core, std::vector<Activation>& released) {
  Task& task = *tasks_[job.member];
  const JobEnd end = task.finish(core);
  task.count(take_page_faults());
  if (job.member > 0) ++followers_[job.member].index;
  if (end.end_of_data) return end;
  for (size_t m = 1; m < tasks_.size(); ++m)
    if (followers_[m].producer == job.member && activates(m, end.visible_at_ns))
      released.push_back({m, end.visible_at_ns});
  return end;
}

std::vector<std::pair<size_t, size_t>> low_before_high(const Plan& plan) {
  const auto needs = [&](size_t task, size_t other) {
    for (size_t producer = plan.tasks[task].on_task; producer != kNone; producer = plan.tasks[producer].on_task)
      if (producer == other) return true;
    return false;
  };
  std::vector<std::pair<size_t, size_t>> pairs;
  for (const auto& members : lane_members(plan))
    for (const size_t low : members)
      for (const size_t high : members)
        if (plan.tasks[low].criticality == Criticality::low && plan.tasks[high].criticality == Criticality::high &&
            !needs(high, low))
          pairs.emplace_back(low, high);
  return pairs;
}

int64_t lane_budget_ns(const Plan& plan, const std::vector<size_t>& members) {
  int64_t sum = 0;
  for (const size_t t : members) sum += enforced_budget_ns(plan.tasks[t]);
  return sum;
}

int64_t longest_lead_ns(const Plan& plan, const std::vector<size_t>& members) {
  return std::min(plan.anticipate_ns, lane_span_ns(plan, members) / 20);
}

int64_t lane_wait_ns(const Plan& plan, const std::vector<size_t>& members) {
  return plan.tasks[members.front()].source.wait_ns;
}

int64_t lane_span_ns(const Plan& plan, const std::vector<size_t>& members) {
  const TaskPlan& head = plan.tasks[members.front()];
  if (members.size() == 1) return head.deadline_ns;
  int64_t sum = 0;
  for (const size_t t : members) sum += plan.tasks[t].deadline_ns;
  return std::min(sum, head.rate->period_ns());
}

std::vector<std::vector<size_t>> lane_members(const Plan& plan) {
  const std::vector<TaskPlan>& tasks = plan.tasks;
  std::vector<std::vector<size_t>> lanes;
  std::vector<size_t> lane_of(tasks.size(), kNone);
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (!tasks[i].rate) continue;
    lane_of[i] = lanes.size();
    lanes.push_back({i});
  }
  // A follower joins once its producer has a lane; a pass without progress means a cycle, which the checker refuses.
  for (bool progress = true; progress;) {
    progress = false;
    for (size_t i = 0; i < tasks.size(); ++i) {
      const size_t producer = tasks[i].on_task;
      if (lane_of[i] != kNone || producer == kNone || lane_of[producer] == kNone) continue;
      lane_of[i] = lane_of[producer];
      lanes[lane_of[i]].push_back(i);
      progress = true;
    }
  }
  if (std::find(lane_of.begin(), lane_of.end(), kNone) != lane_of.end())
    throw std::logic_error("a task has neither a rate nor a producer with one");
  return lanes;
}

}  // namespace takt
