// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/outward_watchdog.hpp"

#include <algorithm>
#include <cmath>

namespace takt {
namespace {

/// Jobs that ended, and releases at which requests let it rest.
uint64_t jobs_of(const TaskStatistics& s) {
  return s.completed.load() + s.skipped.load() + s.reused.load() + s.paused.load();
}

int64_t patience_of(const Plan& plan, size_t task) {
  const double rate_hz = effective_rate_hz(plan, task);
  return rate_hz > 0 ? std::llround(2e9 / rate_hz) + plan.tasks[task].deadline_ns : 0;
}

}  // namespace

std::optional<size_t> forbids_feeding(std::span<const FedTask> tasks) {
  for (size_t i = 0; i < tasks.size(); ++i) {
    const FedTask& task = tasks[i];
    if (task.runs && (task.misses > 0 || (task.patience_ns > 0 && task.idle_ns > task.patience_ns))) return i;
  }
  return std::nullopt;
}

OutwardWatchdog::OutwardWatchdog(const Plan& plan, RunBoard& board, std::vector<WatchdogSink*> sinks)
    : plan_(plan), board_(board), sinks_(std::move(sinks)) {
  for (const WatchdogSink* sink : sinks_)
    if (const int64_t half = sink->timeout_ns() / 2; half > 0)
      interval_ns_ = interval_ns_ == 0 ? half : std::min(interval_ns_, half);
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    if (plan.tasks[t].criticality == Criticality::high) watched_.push_back({t, patience_of(plan, t), 0, 0, 0});
  seen_.resize(watched_.size());
}

void OutwardWatchdog::tick(int64_t now_ns) {
  const int64_t epoch_ns = board_.epoch_ns().load();
  const bool begun = epoch_ns != 0 && now_ns >= epoch_ns, over = now_ns >= board_.stop().end_ns();
  if (begun && !ready_) {
    ready_ = true;
    for (Watched& watched : watched_) watched.progress_ns = now_ns + plan_.tasks[watched.task].offset_ns;
    for (WatchdogSink* sink : sinks_) sink->ready();
  }
  if (begun && !over) {
    look(now_ns);
    at_fault_ = forbids_feeding(seen_);
    tell_status(now_ns);
  }
  const bool due = interval_ns_ > 0 && (!fed_ns_ || now_ns - *fed_ns_ >= interval_ns_);
  if (due && !at_fault_) feed(now_ns);
}

void OutwardWatchdog::end() {
  for (WatchdogSink* sink : sinks_) sink->end();
}

void OutwardWatchdog::look(int64_t now_ns) {
  const uint32_t mode = board_.mode_at(now_ns);
  for (size_t i = 0; i < watched_.size(); ++i) {
    Watched& watched = watched_[i];
    const TaskStatistics& statistics = board_.task(watched.task);
    const bool runs = mode >= plan_.modes.size() || plan_.modes[mode].runs[watched.task] != 0;
    const uint64_t jobs = jobs_of(statistics), misses = statistics.deadline_misses.load();
    if (!runs || jobs != watched.jobs) watched.progress_ns = std::max(watched.progress_ns, now_ns);
    watched.jobs = jobs;
    watched.misses = misses;
    // What was missed while it still ran is no reason any more once the mode has given way.
    if (!runs) watched.misses_at_feed = misses;
    // A count may fall: jobs released after the end of a run are taken back.
    seen_[i] = {runs, misses - std::min(misses, watched.misses_at_feed), now_ns - watched.progress_ns,
                watched.patience_ns};
  }
}

void OutwardWatchdog::feed(int64_t now_ns) {
  fed_ns_ = now_ns;
  for (Watched& watched : watched_) watched.misses_at_feed = watched.misses;
  for (WatchdogSink* sink : sinks_)
    if (sink->timeout_ns() > 0) sink->feed();
}

void OutwardWatchdog::tell_status(int64_t now_ns) {
  const uint32_t mode = board_.mode_at(now_ns);
  std::string text = "mode " + (mode < plan_.modes.size() ? plan_.modes[mode].name : plan_.mode);
  for (size_t t = 0; t < plan_.tasks.size(); ++t)
    if (const SourceState state = board_.source(t).state.load(); state != SourceState::ok)
      text += "; " + plan_.tasks[t].name + " " + to_text(state);
  if (at_fault_)
    text += "; not fed: " + plan_.tasks[watched_[*at_fault_].task].name +
            (seen_[*at_fault_].misses > 0 ? " missed a deadline" : " gets no further");
  if (text == status_) return;
  status_ = text;
  for (WatchdogSink* sink : sinks_) sink->status(text);
}

}  // namespace takt
