// SPDX-License-Identifier: Apache-2.0
// Where tasks begin in a replay, and where their nodes are replaced: snapshots and restarts.
#include <algorithm>

#include "rt/msg/node_state.hpp"
#include "rt/record/replayer_parts.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::record {

void Replayer::begin_tasks() {
  std::vector<char> runs;
  for (size_t t = 0; t < plan_.tasks.size(); ++t) runs.push_back(this->runs(t) ? 1 : 0);
  beginnings_ = beginnings(plan_, log_, runs, options_.begin_ns);
  for (size_t t = 0; t < runs.size(); ++t) {
    if (runs[t] == 0) continue;
    const Beginning& mine = beginnings_[t];
    const bool afresh =
        mine.in_the_middle || (mine.snapshot != nullptr && std::get<Snapshot>(mine.snapshot->what).state == 0);
    if (afresh && counts(t) && result_.begun_afresh++ == 0)
      result_.stateless = plan_.tasks[t].name + (mine.in_the_middle ? ": the record has no snapshot of it"
                                                                    : ": its type does not say what it remembers");
    if (mine.snapshot == nullptr) continue;
    result_.begun += counts(t);
    for (const Restart::Output& output : std::get<Snapshot>(mine.snapshot->what).from.outputs)
      if (output.output < plan_.tasks[t].ports.size())
        ports_[plan_.tasks[t].ports[output.output]].before = output.newest;
  }
}

/// What a task goes through before a job. Snapshots: that where it begins, and those with which it could go on after
/// jobs that could not be run.
bool Replayer::applies(const RecordedEvent& event) const {
  if (event.task >= plan_.tasks.size() || !runs(event.task) || event.at_ns < beginnings_[event.task].at_ns())
    return false;
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  return snapshot != nullptr ? &event == beginnings_[event.task].snapshot || snapshot->state > 0
                             : std::holds_alternative<Restart>(event.what);
}

void Replayer::note_restarts() {
  restarts_.resize(plan_.tasks.size());
  for (const RecordedEvent& event : log_.events())
    if (applies(event)) restarts_[event.task].events.push_back(&event);
  for (Restarts& of_task : restarts_)
    std::stable_sort(of_task.events.begin(), of_task.events.end(),
                     [](const RecordedEvent* a, const RecordedEvent* b) { return a->at_ns < b->at_ns; });
}

/// The first one after the job began.
const Restart* Replayer::next_restart(const RecordedJob& job) const {
  for (const RecordedEvent* event : restarts_[job.task].events)
    if (event->at_ns > job.start_ns && std::holds_alternative<Restart>(event->what))
      return &std::get<Restart>(event->what);
  return nullptr;
}

/// What the task went through between its last job and this one.
void Replayer::restart_before(const RecordedJob& job) {
  Restarts& mine = restarts_[job.task];
  for (; mine.done < mine.events.size() && mine.events[mine.done]->at_ns <= job.start_ns; ++mine.done) {
    const RecordedEvent& event = *mine.events[mine.done];
    if (std::holds_alternative<Restart>(event.what)) mine.failed = !restart(event);
    else if (mine.failed || &event == beginnings_[job.task].snapshot) mine.failed = !begin_at(event);
  }
}

/// Of a node that runs for the first time, or has gone astray.
bool Replayer::begin_at(const RecordedEvent& event) {
  const auto& [from, state] = std::get<Snapshot>(event.what);
  if (!restart(event)) return false;
  if (state == 0) return true;
  Node& node = *plan_.tasks[event.task].node;
  Port& port = ports_[plan_.tasks[event.task].ports.back()];
  const Stored* const message = node.state() != nullptr ? stored(plan_.tasks[event.task].ports.back(), state) : nullptr;
  const auto loaded = message == nullptr ? tl::unexpected(std::string("the record lacks it"))
                                         : node.load_state(*static_cast<const NodeState*>(message->message()));
  port.messages.erase(state);
  if (loaded || &event != beginnings_[event.task].snapshot) return loaded.has_value();
  if (counts(event.task) && result_.begun_afresh++ == 0)
    result_.stateless = plan_.tasks[event.task].name + ": what it remembered cannot be loaded: " + loaded.error();
  return restart(event);  // half loaded is worse
}

bool Replayer::restart(const RecordedEvent& event) {
  const TaskPlan& task = plan_.tasks[event.task];
  const Restart& restart = restart_of(event);
  bool whole = options_.renew != nullptr;
  if (whole) {
    options_.renew(event.task);
    attach_writers(event.task);
  }
  whole = whole && std::all_of(restart.params.begin(), restart.params.end(), [&](const RecordedJob::Param& kept) {
            const auto& params = task.node->params();
            return kept.param < params.size() && params[kept.param]->set(kept.value);
          });
  for_each_handed_over(event, [&](uint16_t output, uint64_t sequence) {
    const Stored* message = stored(task.ports[output], sequence);
    // Behind a snapshot such a node begins without, and that is told.
    whole = whole && (message != nullptr || std::holds_alternative<Snapshot>(event.what));
    if (whole && message != nullptr) PortAccess::hand_over(*task.node->outputs()[output], message->message());
  });
  if (whole) {
    if (!restart.params.empty()) task.node->changed();
    clock_.advance_to(event.at_ns);
    task.node->start(options_.epoch_ns);
    result_.restarts += counts(event.task) && std::holds_alternative<Restart>(event.what);
  }
  for (OutputPort* output : task.node->outputs()) PortAccess::hand_over(*output, nullptr);
  for_each_handed_over(event, [&](uint16_t output, uint64_t sequence) { use(task.ports[output], sequence); });
  for (const Restart::Seen& seen : restart.seen)
    if (seen.edge < task.edges.size()) last_seen_[event.task][seen.edge] = seen.sequence;
  return whole;
}

}  // namespace takt::record
