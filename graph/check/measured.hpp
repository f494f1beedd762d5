// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "graph/language/graph.hpp"
#include "rt/machine/identity.hpp"

namespace takt::graph {

/// A warning with the place of the block, "file:line:column: warning: ...", if the budgets of the schedule were
/// measured on another machine than `here`; "" if they were measured here, or are estimates (no `measured` block).
std::string measured_elsewhere(const ScheduleSpec& schedule, const machine::Identity& here);

}  // namespace takt::graph
