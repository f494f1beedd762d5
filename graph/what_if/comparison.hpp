// SPDX-License-Identifier: Apache-2.0
// A record and its what-if, side by side: as JSON and as text.
#pragma once
#include <string>

#include "graph/language/graph.hpp"
#include "graph/what_if/what_if.hpp"
#include "hal/settings/json.hpp"

namespace takt::what_if {

/// What was asked.
struct Asked {
  std::string record, schedule;  ///< files
  double speed = 1;
};

/// What a record says, under the keys of a run's report: nodes, edges, chains. `facts` and `end`: of the record.
nlohmann::ordered_json recorded_json(const RecordedRun& recorded, const Plan& plan, const graph::GraphSpec& graph,
                                     const mcap::Metadata& facts, const mcap::Metadata& end);

/// {what_if, ok, recorded, predicted}. `predicted` is the report of the predicted run. `ok`: every node of high
/// criticality kept its deadlines; where the graph expects something, whether that is met.
nlohmann::ordered_json comparison_json(const Asked& asked, const Plan& plan, const RecordedRun& recorded,
                                       const Prediction& prediction, nlohmann::ordered_json recorded_report,
                                       nlohmann::ordered_json predicted_report);

/// The same for people, in lines of 80 columns.
std::string comparison_text(const nlohmann::ordered_json& comparison);

}  // namespace takt::what_if
