// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/expect/finding.hpp"

namespace takt::graph {

/// Each stated figure against the report (design section 6). Pure.
std::vector<Finding> figure_findings(const FigureExpectations& expected, const nlohmann::ordered_json& report);

/// What is expected of every run, stated or not: nodes of high criticality miss no deadline and complete all releases
/// but one (each unless `misses` or `rates` name the node); no node fails, such as hangs or throws. For `except`
/// nothing is promised. Pure.
std::vector<Finding> promise_findings(const FigureExpectations& expected, const nlohmann::ordered_json& report,
                                      const std::vector<std::string>& except);

}  // namespace takt::graph
