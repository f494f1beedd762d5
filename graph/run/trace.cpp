// SPDX-License-Identifier: Apache-2.0
#include "graph/run/trace.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/explain/trace_file.hpp"
#include "graph/run/outputs.hpp"
#include "rt/abi.hpp"
#include "rt/machine/facts.hpp"

namespace takt::command {
namespace {

/// The CPUs on which jobs may run: those of the schedule where threads are pinned to them, else all that are allowed.
std::vector<int> cpus_of(const Plan& plan) {
  if (plan.policy == Policy::fixed && !plan.cores.empty()) return plan.cores;
  const std::vector<int> allowed = machine::SystemFacts().allowed_cpus();
  return allowed.empty() ? plan.cores : allowed;
}

/// Changes of mode belong to no thread; the board has them all.
void add_modes(const RunBoard& board, trace::Trace& trace) {
  for (size_t i = 0; i < board.modes().size(); ++i)
    if (const ModeLog::Change* change = board.modes().change(i); change != nullptr && !board.modes().repeats(i))
      trace.marks.push_back({trace::Kind::mode, change->from_ns, change->mode});
  std::stable_sort(trace.marks.begin(), trace.marks.end(),
                   [](const trace::Mark& a, const trace::Mark& b) { return a.at_ns < b.at_ns; });
}

trace::Source best_source(const RunOptions& options) {
  if (options.clock == "virtual" || options.trace.empty() || options.trace_source == "none") return trace::Source::none;
  return options.trace_source == "perf" ? trace::Source::perf : trace::Source::tracefs;
}

}  // namespace

RunTrace::RunTrace(const RunOptions& options, const Plan& plan, size_t processes) : options_(options) {
  // One for each lane, or for each cooperative worker: no process has more than it has lanes, or one. Some for those of
  // restarted processes that find none of their name.
  const size_t spare = processes > 1 ? 8 : 0;
  if (!options.trace.empty() || !options.record.empty() || options.keep_ring)
    rings_ = std::make_unique<trace::Rings>(plan.tasks.size() + processes + spare);
}

void RunTrace::collect(const Plan& plan, RunRecord& record) {
  if (!rings_) return;
  trace::Collector::Options how;
  how.cpus = cpus_of(plan);
  how.best = best_source(options_);
  how.by_caller = options_.clock == "virtual";
  if (options_.trace.empty()) how.records_kept = 0;
  if (record.listens()) how.listener = [&record](int32_t ring, const trace::Event& event) { record.take(ring, event); };
  collector_ = std::make_unique<trace::Collector>(*rings_, std::move(how));
}

void RunTrace::write(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, const RunResult& result) {
  if (!collector_) return;
  const trace::Recording recording = collector_->finish();
  collector_.reset();
  if (options_.trace.empty()) return;
  trace::Trace trace = trace::assemble(recording);
  trace.policy = to_string(result.policy_granted);
  trace.epoch_ns = result.epoch_ns;
  trace.end_ns = result.end_ns;
  explain::describe(plan, trace);
  add_modes(board, trace);
  explain::Json head{{"graph", graph.name},
                     {"schedule", graph.schedule.name},
                     {"profile", graph.profile},
                     {"clock", options_.clock},
                     {"policy_asked", to_string(graph.schedule.policy)},
                     {"commit", version().commit},
                     {"collector_cpu_ms", static_cast<double>(recording.collector_cpu_ns) / 1e6}};
  explain::write_trace(options_.outputs->trace->stream(), head, trace);
  options_.outputs->write(options_.outputs->trace, "", "--trace");
}

}  // namespace takt::command
