// SPDX-License-Identifier: Apache-2.0
// A trace as a file: the JSON that chrome://tracing and https://ui.perfetto.dev load ("Trace Event Format", JSON object
// form), with all that `takt explain` needs to read it back.
#pragma once
#include <ostream>
#include <string>
#include <tl/expected.hpp>

#include "hal/settings/json.hpp"
#include "rt/sched/plan.hpp"
#include "rt/trace/trace.hpp"

namespace takt::explain {

using Json = nlohmann::ordered_json;

/// Names, lanes, budgets and ports of the plan for a trace of its run.
void describe(const Plan& plan, trace::Trace& trace);

/// Tracks: one per node with its jobs, one per CPU with who had it. Arrows: messages, from publication to the job that
/// latched them. `head`: what stands beside them ("otherData"), for instance graph and schedule.
void write_trace(std::ostream& out, const Json& head, const trace::Trace& trace);

struct TraceFile {
  Json head;
  trace::Trace trace;
};
/// The reverse. The error says what is missing or wrong, without the file's name.
tl::expected<TraceFile, std::string> read_trace(const Json& file);

}  // namespace takt::explain
