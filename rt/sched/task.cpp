// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/task.hpp"

#include <algorithm>

#include "rt/sched/port_access.hpp"

namespace takt {
namespace {
void count(std::atomic<uint64_t>& counter, uint64_t by = 1) { counter.fetch_add(by, std::memory_order_relaxed); }
}  // namespace

void TaskStatistics::add_lateness(int64_t ns) {
  const uint64_t index = lateness.count();
  if (index < kWindow) first_[index] = ns;
  last_[index % kWindow] = ns;
  lateness.add(ns);
}

double TaskStatistics::drift_us() const {
  const auto filled = static_cast<ptrdiff_t>(std::min<uint64_t>(lateness.count(), kWindow));
  if (filled == 0) return 0;
  const int64_t early = *std::min_element(first_.begin(), first_.begin() + filled);
  const int64_t late = *std::min_element(last_.begin(), last_.begin() + filled);
  return static_cast<double>(late - early) / 1e3;
}

Task::Task(const TaskPlan& plan, Transport& transport, const Clock& clock, std::string mode)
    : plan_(plan), clock_(clock), mode_(std::move(mode)), latch_(plan, transport), published_(plan.ports.size()) {
  statistics_.output_age.resize(plan_.ports.size());
  for (size_t i = 0; i < plan_.ports.size(); ++i) {
    writers_.push_back(transport.make_writer(plan_.ports[i]));
    PortAccess::attach(*plan_.node->outputs()[i], writers_.back().get());
  }
}

Task::~Task() {
  for (OutputPort* output : plan_.node->outputs()) PortAccess::attach(*output, nullptr);
}

JobEnd Task::run(uint64_t index, int64_t release_ns, int64_t modelled_ns) {
  const bool modelled = modelled_ns >= 0;
  const int64_t started = clock_.now_ns();
  const int64_t deadline = release_ns + plan_.deadline_ns;

  count(statistics_.stale_inputs, latch_.acquire(release_ns, started));
  if (!plan_.edges.empty() && plan_.node->inputs()[plan_.edges.front().input]->is_new()) count(statistics_.new_inputs);
  Job job(clock_, index, release_ns, deadline, 0, mode_);
  plan_.node->run(job);

  JobEnd end;
  end.end_of_data = job.ended();
  end.finished_ns = modelled ? std::max(started, release_ns) + modelled_ns : clock_.now_ns();
  publish(end, deadline, modelled);
  latch_.release();
  const ThreadUse used = take_thread_use();
  statistics_.cpu_ns += used.cpu_ns;
  statistics_.allocations += used.memory.allocations;
  statistics_.page_faults += used.memory.page_faults;
  if (!end.end_of_data) {
    statistics_.add_lateness(started - release_ns);
    statistics_.exec.add(used.cpu_ns);
    statistics_.last_exec_ns.store(used.cpu_ns, std::memory_order_relaxed);
    statistics_.preempted_ns += modelled ? 0 : std::max<int64_t>(0, end.finished_ns - started - used.cpu_ns);
    if (plan_.budget_ns > 0 && used.cpu_ns > plan_.budget_ns) count(statistics_.budget_overruns);
    if (job.without_result()) count(statistics_.no_result);
  }
  return end;
}

void Task::publish(JobEnd& end, int64_t deadline_ns, bool modelled) {
  // The instant of publication is read once per job: all outputs of a job become visible together.
  const int64_t now = modelled ? end.finished_ns : clock_.now_ns();
  end.late = now > deadline_ns;
  end.visible_at_ns = plan_.publish == PublishAt::let ? std::max(now, deadline_ns) : now;
  for (size_t i = 0; i < writers_.size(); ++i) settle_output(i, end.late, now, end.visible_at_ns);
  if (end.end_of_data) return;
  statistics_.publish.add(modelled ? 0 : clock_.now_ns() - end.finished_ns);
  const int64_t response = now - (deadline_ns - plan_.deadline_ns);
  statistics_.response.add(response);
  statistics_.last_response_ns.store(response, std::memory_order_relaxed);
  if (end.late) count(statistics_.deadline_misses);
  const bool skip = end.late && plan_.on_miss == OnMiss::skip, reuse = end.late && plan_.on_miss == OnMiss::reuse_last;
  std::atomic<uint64_t>& counter = skip ? statistics_.skipped : reuse ? statistics_.reused : statistics_.completed;
  count(counter);
  outcomes_[outcome_count_++ % outcomes_.size()] = {deadline_ns - plan_.deadline_ns, &counter, end.late};
}

void Task::forget_from(int64_t end_ns) {
  for (Outcome& outcome : outcomes_) {
    if (outcome.counter == nullptr || outcome.release_ns < end_ns) continue;
    outcome.counter->fetch_sub(1);
    if (outcome.late) statistics_.deadline_misses.fetch_sub(1);
    outcome.counter = nullptr;
  }
}

void Task::settle_output(size_t i, bool late, int64_t now_ns, int64_t visible_at_ns) {
  OutputPort& output = *plan_.node->outputs()[i];
  Writer& writer = *writers_[i];
  published_[i] = false;
  const bool withheld = late && (plan_.on_miss == OnMiss::skip || plan_.on_miss == OnMiss::reuse_last);
  if (PortAccess::sent(output) && !withheld) {
    writer.publish(PortAccess::stamp_ns(output), now_ns, visible_at_ns);
    published_[i] = true;
    statistics_.output_age[i].add(now_ns - PortAccess::stamp_ns(output));
  } else {
    writer.discard();
    if (withheld && plan_.on_miss == OnMiss::reuse_last) published_[i] = writer.repeat(now_ns, visible_at_ns);
  }
  PortAccess::reset(output);
}

bool Task::published(size_t port) const {
  const auto it = std::find(plan_.ports.begin(), plan_.ports.end(), port);
  return it != plan_.ports.end() && published_[static_cast<size_t>(it - plan_.ports.begin())];
}

}  // namespace takt
