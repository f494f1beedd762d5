// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/check/check.hpp"

namespace takt::graph {

/// Verdict, memory, use of the cores and problems, in lines for a terminal.
std::string check_text(const CheckResult& result, const GraphSpec& graph);

}  // namespace takt::graph
