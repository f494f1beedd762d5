// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "graph/command/machine.hpp"
#include "graph/compose/composition.hpp"
#include "rt/sched/executor.hpp"

namespace takt::command {

/// Everything a finished run can be reported from.
struct RunFacts {
  const graph::GraphSpec& graph;
  const graph::Composition& composition;
  const Executor& executor;
  const RunResult& result;
  const Transport& transport;
  ProcessReading before, after;
  int64_t simulator_cpu_ns = 0;
  std::string clock, policy_asked;
  std::vector<std::string> adjusted;
};

/// The report of design section 6: times in the unit the key says, null where there are no samples.
nlohmann::ordered_json make_report(const RunFacts& facts);

/// One screen of text from the report: what ran, what was granted, what was missed.
std::string summary_text(const nlohmann::ordered_json& report);

}  // namespace takt::command
