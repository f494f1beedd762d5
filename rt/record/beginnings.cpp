// SPDX-License-Identifier: Apache-2.0
#include "rt/record/beginnings.hpp"

#include <algorithm>
#include <map>

namespace takt::record {
namespace {

class Search {
 public:
  Search(const Plan& plan, const LogFile& log, const std::vector<char>& runs, int64_t from_ns)
      : plan_(plan), log_(log), runs_(runs), snapshots_(plan.tasks.size()), found_(plan.tasks.size()) {
    for (const PortPlan& port : plan.ports) channels_.push_back(log.channel(port.node + "." + port.port));
    for (const RecordedEvent& event : log.events())
      if (std::holds_alternative<Snapshot>(event.what) && event.task < runs.size() && runs[event.task] != 0 &&
          usable(event))
        snapshots_[event.task].push_back(&event);
    for (auto& of_task : snapshots_)
      std::sort(of_task.begin(), of_task.end(), [](const auto* a, const auto* b) { return a->at_ns < b->at_ns; });
    note_jobs();
    for (size_t t = 0; t < found_.size(); ++t)
      if (!begin_before(t, from_ns) && first_job_[t] > 0) begin_at_first(t);
  }

  std::vector<Beginning> run() {
    while (begin_earlier()) {
    }
    for (size_t t = 0; t < found_.size(); ++t)
      found_[t].in_the_middle = found_[t].snapshot == nullptr && first_job_[t] > 0 && first_job_[t] != UINT32_MAX;
    return found_;
  }

 private:
  bool usable(const RecordedEvent& event) const {
    const uint64_t state = std::get<Snapshot>(event.what).state;
    if (state == 0) return true;
    const auto& messages = log_.messages(channels_[plan_.tasks[event.task].ports.back()]);
    const auto message = messages.find(state);
    return message != messages.end() && message->second.whole;
  }

  bool whole(size_t port, uint64_t sequence) const {
    const auto& messages = log_.messages(channels_[port]);
    const auto message = messages.find(sequence);
    return message != messages.end() && message->second.whole;
  }

  void note_jobs() {
    first_job_.assign(plan_.tasks.size(), UINT32_MAX);
    for (const RecordedJob& job : log_.jobs()) {
      if (job.task >= plan_.tasks.size()) continue;
      first_job_[job.task] = std::min(first_job_[job.task], job.index);
      const std::vector<size_t>& ports = plan_.tasks[job.task].ports;
      for (const RecordedJob::Output& output : job.outputs)
        if (output.output < ports.size() && !whole(ports[output.output], output.sequence))
          made_[{ports[output.output], output.sequence}] = &job;
    }
  }

  /// At its last snapshot until then; false: there is none.
  bool begin_before(size_t task, int64_t at_ns) {
    const auto& all = snapshots_[task];
    const auto after = std::upper_bound(all.begin(), all.end(), at_ns,
                                        [](int64_t at, const auto* event) { return at < event->at_ns; });
    found_[task].snapshot = after == all.begin() ? nullptr : *std::prev(after);
    return after != all.begin();
  }

  void begin_at_first(size_t task) {
    if (!snapshots_[task].empty()) found_[task].snapshot = snapshots_[task].front();
  }

  /// True if a task had to. What a task is given before its first snapshot cannot be made.
  bool begin_earlier() {
    bool moved = false;
    for (const RecordedJob& job : log_.jobs()) {
      if (job.task >= runs_.size() || runs_[job.task] == 0 || job.index < found_[job.task].job()) continue;
      for (const RecordedJob::Input& input : job.inputs) {
        if (input.edge >= plan_.tasks[job.task].edges.size()) continue;
        const size_t port = plan_.tasks[job.task].edges[input.edge].port;
        for (const RecordedJob::Run& run : input.held)
          for (uint64_t s = run.first; s < run.first + run.count; ++s) moved = make_it(port, s) || moved;
      }
    }
    return moved;
  }

  bool make_it(size_t port, uint64_t sequence) {
    const auto made = made_.find({port, sequence});
    if (made == made_.end() || runs_[made->second->task] == 0) return false;
    const RecordedJob& job = *made->second;
    if (job.index >= found_[job.task].job()) return false;
    const Beginning before = found_[job.task];
    if (begin_before(job.task, job.start_ns)) return true;
    if (first_job_[job.task] == 0) return true;  // it begins with the run
    found_[job.task] = before;
    return false;
  }

  const Plan& plan_;
  const LogFile& log_;
  const std::vector<char>& runs_;
  std::vector<uint16_t> channels_;
  std::vector<std::vector<const RecordedEvent*>> snapshots_;
  std::map<std::pair<size_t, uint64_t>, const RecordedJob*> made_;  ///< what the record has no fields of
  std::vector<uint32_t> first_job_;
  std::vector<Beginning> found_;
};

}  // namespace

std::vector<Beginning> beginnings(const Plan& plan, const LogFile& log, const std::vector<char>& runs,
                                  int64_t from_ns) {
  return Search(plan, log, runs, from_ns).run();
}

}  // namespace takt::record
