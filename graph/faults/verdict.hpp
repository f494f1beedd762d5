// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/expect/finding.hpp"
#include "graph/faults/health.hpp"
#include "graph/faults/scenario.hpp"
#include "hal/settings/json.hpp"

namespace takt::graph {

/// A process that went and came back.
struct Restart {
  std::string process;
  int64_t gone_ns = 0, back_ns = 0;  ///< since the epoch
};

/// What a run shows beside its report.
struct RunEvents {
  std::vector<uint64_t> struck;           ///< by fault of the scenario
  std::vector<std::string> struck_nodes;  ///< whose own jobs the faults strike
  std::vector<Restart> restarts;
  std::vector<Unwell> unwell;
  uint64_t unaccounted = 0;  ///< messages
  int64_t end_ns = 0;        ///< of the run, since the epoch
  int exit = 0;              ///< had it no scenario
};

/// What the scenario expects against what the run showed; `report` as design section 6 has it. Always asked for, beside
/// what the file states: every fault struck at least once; promise_findings() of the nodes whose jobs no fault strikes;
/// an exit of 0 or 1 unless `exit` is stated. Pure.
std::vector<Finding> verdict(const Scenario& scenario, const nlohmann::ordered_json& report, const RunEvents& events);

/// The block "scenario" of the report.
nlohmann::ordered_json scenario_json(const Scenario& scenario, const RunEvents& events,
                                     const std::vector<Finding>& findings);
/// Its table for people.
std::string scenario_text(const nlohmann::ordered_json& scenario);

}  // namespace takt::graph
