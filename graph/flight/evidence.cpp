// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/evidence.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

#include "graph/explain/sentence.hpp"
#include "graph/explain/trace_file.hpp"

namespace takt::flight {
namespace {

/// Some 100 bytes each.
constexpr size_t kMost = 200'000;

}  // namespace

void Evidence::note(int32_t ring, const trace::Event& event) {
  const std::lock_guard lock(mutex_);
  events_.push_back({ring, event});
  // Instants of different rings come as they are emptied; those of answers are none.
  while (events_.size() > kMost || (event.at_ns > keep_ns_ && events_.front().event.at_ns < event.at_ns - keep_ns_))
    events_.pop_front();
}

trace::Trace Evidence::trace_of(int64_t from_ns, int64_t to_ns) const {
  trace::Recording recording;
  {
    const std::lock_guard lock(mutex_);
    recording.events.assign(events_.begin(), events_.end());
  }
  recording.first_ns = from_ns;
  recording.last_ns = to_ns;
  trace::Trace trace = trace::assemble(recording);
  trace.policy = to_string(plan_.policy);
  trace.epoch_ns = board_.epoch_ns();
  trace.end_ns = to_ns;
  trace.source_note = "a ring notes what jobs say, not who had the CPUs";
  explain::describe(plan_, trace);
  std::erase_if(trace.jobs,
                [&](const trace::JobSpan& job) { return job.finish_ns < from_ns || job.start_ns >= to_ns; });
  return trace;
}

Said Evidence::say(const Cause& cause, int64_t from_ns, int64_t to_ns) const {
  const trace::Trace trace = trace_of(from_ns, to_ns);
  Said said{cause.what, {}, report()};
  const auto missed = std::find_if(trace.jobs.begin(), trace.jobs.end(), [&](const trace::JobSpan& job) {
    return cause.kind == "miss" && job.task < trace.tasks.size() && trace.tasks[job.task].name == cause.subject &&
           job.job == cause.job;
  });
  if (missed != trace.jobs.end())
    said.sentence = explain::sentence(trace, *missed, trace::blame(trace::Evidence(trace), *missed));
  std::ostringstream text;
  explain::write_trace(text, {{"graph", graph_.name}, {"schedule", graph_.schedule.name}, {"profile", graph_.profile}},
                       trace);
  said.trace = std::move(text).str();
  return said;
}

std::string Evidence::report() const {
  explain::Json nodes = explain::Json::array();
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    const TaskStatistics& s = board_.task(t);
    nodes.push_back({{"name", plan_.tasks[t].name},
                     {"completed", s.completed.load()},
                     {"skipped", s.skipped.load()},
                     {"reused", s.reused.load()},
                     {"deadline_misses", s.deadline_misses.load()},
                     {"budget_overruns", s.budget_overruns.load()},
                     {"last_exec_ms", static_cast<double>(s.last_exec_ns.load()) / 1e6},
                     {"last_response_ms", static_cast<double>(s.last_response_ns.load()) / 1e6}});
  }
  return explain::Json{{"graph", graph_.name}, {"profile", graph_.profile}, {"nodes", nodes}}.dump();
}

}  // namespace takt::flight
