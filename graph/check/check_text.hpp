// SPDX-License-Identifier: Apache-2.0
// The result of a check as text of at most 80 columns (messages apart), and as JSON.
#pragma once
#include "graph/check/check.hpp"

namespace takt::graph {

std::string check_text(const GraphSpec& graph, const Plan& plan, const CheckOptions& options,
                       const CheckResult& result);
nlohmann::ordered_json check_json(const Plan& plan, const CheckOptions& options, const CheckResult& result);

}  // namespace takt::graph
