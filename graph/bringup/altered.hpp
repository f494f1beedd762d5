// SPDX-License-Identifier: Apache-2.0
// Graphs for trials, made of the one that is brought up.
#pragma once
#include <string>

#include "graph/language/graph.hpp"

namespace takt::bringup {

/// The node that drives the base in a trial. Its parameter `speed` is 0 until somebody sets it.
inline constexpr const char* kDriver = "bringup_drive";

/// That device, and nothing else of the graph.
void leave_only(graph::GraphSpec& graph, const std::string& device);
/// Nobody drives the base any more but kDriver, a node of type `cruise`.
void drive_by_hand(graph::GraphSpec& graph, const std::string& base);

}  // namespace takt::bringup
