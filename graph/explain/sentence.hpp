// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/explain/trace_file.hpp"
#include "rt/trace/blame.hpp"

namespace takt::explain {

/// "ground_map missed job 81 by 14.2 ms: released late 0.3, preempted 9.1 by stereo on cpu 1, 4.8 over its own budget
/// (switches from tracefs)". The figures are ms, rounded so that those shown add up to the miss shown.
std::string sentence(const trace::Trace& trace, const trace::JobSpan& job, const trace::Blame& blame);

/// "preempted by stereo on cpu 1", "over its own budget": the same words without a figure.
std::string cause_text(trace::Cause cause, const std::string& who, int cpu, const std::string& node);

/// What a report can say of a node that missed: how often, and the longest of each time; not of one job. Empty if it
/// missed nothing. `node`: an element of the report's "nodes".
std::string report_sentence(const Json& node);

}  // namespace takt::explain
