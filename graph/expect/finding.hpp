// SPDX-License-Identifier: Apache-2.0
// What was expected of a run and what it showed.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::graph {

struct Finding {
  std::string what, expected, observed;
  bool met = false;
  std::optional<double> since_s = {};  ///< of the run; nothing: there is no such instant
};

bool all_met(const std::vector<Finding>& findings);

/// "at least 2 m, at most 3 m", or "2 m" where both are that. `unit` with the space before it.
std::string bound_text(const Bound& bound, std::string_view unit);

/// [{what, expected, observed, met}], and since_s where it is known.
nlohmann::ordered_json findings_json(const std::vector<Finding>& findings);
/// Such a list as a table for people.
std::string findings_text(const nlohmann::ordered_json& findings);

}  // namespace takt::graph
