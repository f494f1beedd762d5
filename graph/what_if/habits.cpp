// SPDX-License-Identifier: Apache-2.0
#include "graph/what_if/habits.hpp"

#include <algorithm>
#include <cstdlib>

#include "rt/node.hpp"

namespace takt::what_if {

using record::RecordedJob;

const RecordedJob::Output* made(const RecordedJob& job, size_t output) {
  const auto found = std::find_if(job.outputs.begin(), job.outputs.end(), [&](const RecordedJob::Output& one) {
    return one.output == output && !one.repeated;
  });
  return found == job.outputs.end() ? nullptr : &*found;
}

Stamps::Stamps(const std::map<uint64_t, record::LogFile::Known>& messages) : stamps_(messages.size()) {
  for (const auto& [sequence, known] : messages) stamps_.emplace(sequence, known.stamp_ns);
}

std::optional<int64_t> Stamps::of(uint64_t sequence) const {
  const auto found = stamps_.find(sequence);
  return found == stamps_.end() ? std::nullopt : std::optional(found->second);
}

void Stamps::repeat(uint64_t sequence) {
  if (const auto before_ns = of(sequence - 1)) stamps_.try_emplace(sequence, *before_ns);
}

Habits::Habits(const record::LogFile& log, const Plan& plan, const std::vector<const RecordedJob*>& jobs)
    : plan_(plan), jobs_(jobs), publishes_late_(plan.tasks.size()) {
  for (const PortPlan& port : plan.ports) stamps_.emplace_back(log.messages(log.channel(port.node + "." + port.port)));
  for (const TaskPlan& task : plan.tasks)
    habits_.emplace_back(task.ports.size(), Habit{std::vector<char>(task.edges.size()), false, false});
  for (const RecordedJob* job : jobs)
    for (const RecordedJob::Output& output : job->outputs) {
      if (output.repeated) stamps_[plan.tasks[job->task].ports[output.output]].repeat(output.sequence);
      else if (job->late) publishes_late_[job->task] = 1;
    }
  for_each_job([this](const RecordedJob& job, const Seen& seen) { learn_origins(job, seen); });
  for_each_job([this](const RecordedJob& job, const Seen& seen) { learn_pauses(job, seen); });
}

bool Habits::carries(const RecordedJob& job, uint16_t edge, uint16_t output) const {
  const TaskPlan& task = plan_.tasks[job.task];
  const InputPort& input = *task.node->inputs()[task.edges[edge].input];
  return !task.device && &input != task.node->control() && task.node->outputs()[output]->stamped_by(input);
}

StampOrigin Habits::origin(const RecordedJob& job, uint16_t output, int64_t stamp_ns) const {
  if (stamp_ns > job.release_ns && stamp_ns >= job.start_ns) return {StampOrigin::start, 0, 0, stamp_ns - job.start_ns};
  StampOrigin best{StampOrigin::release, 0, 0, stamp_ns - job.release_ns};
  if (stamp_ns >= job.release_ns) return best;
  std::pair<int64_t, uint16_t> least{INT64_MAX, 0};
  for_each_held(job, [&](uint16_t edge, uint16_t back, uint64_t sequence) {
    const auto held_ns = stamps_[plan_.tasks[job.task].edges[edge].port].of(sequence);
    if (!held_ns || !carries(job, edge, output)) return;
    const std::pair<int64_t, uint16_t> far{std::abs(stamp_ns - *held_ns), back};
    if (far >= least) return;
    least = far;
    best = {StampOrigin::input, edge, back, stamp_ns - *held_ns};
  });
  return best;
}

StampOrigin Habits::newest_input(const RecordedJob& job, uint16_t output) const {
  for (const RecordedJob::Input& input : job.inputs)
    if (!input.held.empty() && carries(job, input.edge, output)) return {StampOrigin::input, input.edge, 0, 0};
  return {};
}

bool Habits::withheld(const RecordedJob& job) const {
  return job.late && publishes_late_[job.task] == 0 &&
         std::all_of(job.outputs.begin(), job.outputs.end(), [](const auto& output) { return output.repeated; });
}

bool Habits::if_new(size_t task, size_t output) const {
  const Habit& habit = habits_[task][output];
  return habit.waited && !habit.from_old;
}

bool Habits::only_old(const RecordedJob& job, const Seen& seen, size_t output) const {
  const Habit& habit = habits_[job.task][output];
  bool any = false, fresh = false;
  for_each_held(job, [&](uint16_t edge, uint16_t, uint64_t n) {
    if (habit.from[edge] == 0) return;
    any = true;
    fresh = fresh || n > seen[edge];
  });
  return any && !fresh;
}

void Habits::learn_origins(const RecordedJob& job, const Seen& seen) {
  for (const RecordedJob::Output& output : job.outputs) {
    const auto stamp_ns = stamps_[plan_.tasks[job.task].ports[output.output]].of(output.sequence);
    if (output.repeated || !stamp_ns) continue;
    Habit& habit = habits_[job.task][output.output];
    const StampOrigin from = origin(job, output.output, *stamp_ns);
    if (from.of != StampOrigin::input) {
      habit.from_old = true;
      continue;
    }
    habit.from[from.edge] = 1;
    for_each_held(job, [&](uint16_t edge, uint16_t back, uint64_t n) {
      if (edge == from.edge && back == from.back && n <= seen[edge]) habit.from_old = true;
    });
  }
}

void Habits::learn_pauses(const RecordedJob& job, const Seen& seen) {
  for (size_t o = 0; o < habits_[job.task].size() && !withheld(job); ++o)
    if (made(job, o) == nullptr && only_old(job, seen, o)) habits_[job.task][o].waited = true;
}

}  // namespace takt::what_if
