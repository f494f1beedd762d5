// SPDX-License-Identifier: Apache-2.0
#include "rt/record/snapshots.hpp"

#include <algorithm>

namespace takt::record {

Snapshots::Snapshots(const Plan& plan, int64_t every_ns) : every_ns_(every_ns) {
  for (const TaskPlan& task : plan.tasks) {
    Task& mine = tasks_.emplace_back();
    mine.device = task.device;
    mine.says_state = task.state_every_ns > 0;
    mine.seen.resize(task.edges.size());
    mine.newest.resize(task.ports.size());
  }
}

std::optional<RecordedEvent> Snapshots::after(const RecordedJob& job) {
  if (every_ns_ == 0 || job.task >= tasks_.size()) return std::nullopt;
  Task& task = tasks_[job.task];
  if (task.device) return std::nullopt;
  for (const RecordedJob::Param& changed : job.params) task.params[changed.param] = changed.value;
  for (const RecordedJob::Input& input : job.inputs)
    if (!input.held.empty()) {
      const RecordedJob::Run& last = input.held.back();
      task.seen[input.edge] = std::max(task.seen[input.edge], last.first + last.count - 1);
    }
  uint64_t state = 0;
  if (job.cut_off) return std::nullopt;  // what of it came out, only a restart says
  for (const RecordedJob::Output& output : job.outputs) {
    task.newest[output.output] = output.sequence;
    if (task.says_state && output.output + 1U == task.newest.size() && !output.repeated) state = output.sequence;
  }
  const int64_t slot = job.release_ns / every_ns_;
  if (task.says_state ? state == 0 : slot == task.slot) return std::nullopt;
  task.slot = slot;
  Snapshot snapshot;
  snapshot.state = state;
  snapshot.from.level = job.level;
  for (size_t i = 0; i < task.newest.size(); ++i)
    if (task.newest[i] > 0) snapshot.from.outputs.push_back({static_cast<uint16_t>(i), task.newest[i], task.newest[i]});
  for (size_t i = 0; i < task.seen.size(); ++i)
    if (task.seen[i] > 0) snapshot.from.seen.push_back({static_cast<uint16_t>(i), task.seen[i]});
  for (const auto& [param, value] : task.params) snapshot.from.params.push_back({param, value});
  return RecordedEvent{static_cast<uint16_t>(EventKind::snapshot), job.task, job.index + 1, job.published_ns,
                       std::move(snapshot)};
}

void Snapshots::note(const RecordedEvent& event) {
  const auto* const restart = std::get_if<Restart>(&event.what);
  if (restart == nullptr || event.task >= tasks_.size()) return;
  Task& task = tasks_[event.task];
  task.params.clear();
  for (const RecordedJob::Param& kept : restart->params) task.params[kept.param] = kept.value;
  for (const Restart::Output& output : restart->outputs)
    if (output.output < task.newest.size()) task.newest[output.output] = output.newest;
  std::fill(task.seen.begin(), task.seen.end(), 0);
  for (const Restart::Seen& seen : restart->seen)
    if (seen.edge < task.seen.size()) task.seen[seen.edge] = seen.sequence;
}

}  // namespace takt::record
