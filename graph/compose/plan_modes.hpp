// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/language/graph.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Fills in Plan::modes: the mode of the start, and every other one that needs no node which that mode leaves out (such
/// nodes were never made). `safe_stop` is always among them: as the graph defines it, or, if the graph does not, the
/// high-criticality nodes, the devices, and what those need to have as input. And Plan::mode_rules: which of them the
/// loss of devices leads to. The jobs of a device go on in the modes that its loss leads to, and try to get it back.
void add_modes(const GraphSpec& graph, Plan& plan);

}  // namespace takt::graph
