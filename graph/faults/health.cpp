// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/health.hpp"

#include <algorithm>

#include "rt/sched/executor.hpp"

namespace takt::graph {

HealthWatch::HealthWatch(const Plan& plan, const RunBoard& board)
    : plan_(plan), board_(board), seen_(plan.tasks.size()), producers_(plan) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) seen_[t].stale.resize(plan.tasks[t].edges.size());
}

void HealthWatch::look(int64_t now_ns, int64_t epoch_ns) {
  if (epoch_ns == 0 || now_ns < next_ns_) return;
  next_ns_ = now_ns + kPeriod_ns;
  for (size_t t = 0; t < plan_.tasks.size(); ++t) see_whether_it_rests(t);
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    Seen& seen = seen_[t];
    const uint64_t now = troubles(board_.task(t));
    const uint64_t lacks = missing(t, seen, now_ns, epoch_ns);
    const bool stale = stale_beyond_rest(t);
    if (now > seen.troubles || lacks > 0 || stale) unwell_.push_back({plan_.tasks[t].name, now_ns - epoch_ns});
    seen.troubles = now;
  }
}

uint64_t HealthWatch::troubles(const TaskStatistics& s) {
  return s.skipped.load() + s.reused.load() + s.no_result.load();
}

void HealthWatch::see_whether_it_rests(size_t task) {
  Seen& seen = seen_[task];
  const uint64_t jobs = board_.task(task).job_count.load(), pauses = board_.task(task).paused.load();
  if (jobs > seen.jobs) seen.rests = false;
  else if (pauses > seen.pauses) seen.rests = true;
  seen.jobs = jobs;
  seen.pauses = pauses;
}

bool HealthWatch::stale_beyond_rest(size_t task) {
  bool any = false;
  for (size_t e = 0; e < plan_.tasks[task].edges.size(); ++e) {
    const uint64_t now = board_.edge(task, e).stale.load(std::memory_order_relaxed);
    const size_t producer = producers_.find(plan_.tasks[task].edges[e].port);
    any = any || (now > seen_[task].stale[e] && (producer == kNone || !seen_[producer].rests));
    seen_[task].stale[e] = now;
  }
  return any;
}

uint64_t HealthWatch::missing(size_t task, Seen& seen, int64_t now_ns, int64_t epoch_ns) const {
  const TaskPlan& plan = plan_.tasks[task];
  const TaskStatistics& s = board_.task(task);
  if (!plan.rate) return 0;
  const int64_t patience_ns = std::max(plan.deadline_ns, plan.rate->period_ns());
  if (static_cast<double>(kPeriod_ns + patience_ns) * 1e-9 * plan.rate->hz() >
      0.75 * static_cast<double>(s.jobs.size()))
    return 0;
  const int64_t from_ns = std::max(seen.due_ns, epoch_ns), due_ns = std::max(from_ns, now_ns - patience_ns);
  seen.due_ns = due_ns;
  const int64_t origin_ns = epoch_ns + plan.offset_ns;
  int64_t lacking = plan.rate->releases_before(origin_ns, due_ns) - plan.rate->releases_before(origin_ns, from_ns);
  lacking -= static_cast<int64_t>(left_out_jobs(plan_, board_, task, epoch_ns, due_ns) -
                                  left_out_jobs(plan_, board_, task, epoch_ns, from_ns));
  const uint64_t count = s.job_count.load(std::memory_order_acquire);
  for (uint64_t n = count - std::min<uint64_t>(count, s.jobs.size()); n < count; ++n) {
    const int64_t release_ns = s.jobs[n % s.jobs.size()].release_ns;
    lacking -= release_ns >= from_ns && release_ns < due_ns ? 1 : 0;
  }
  // A release at which requests did not let the node run leaves no job behind; each excuses one.
  const auto excused =
      std::min<int64_t>(std::max<int64_t>(lacking, 0), static_cast<int64_t>(s.paused.load() - seen.paused));
  seen.paused += static_cast<uint64_t>(excused);
  return static_cast<uint64_t>(std::max<int64_t>(lacking - excused, 0));
}

}  // namespace takt::graph
