// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"
#include "rt/node.hpp"
#include "rt/sched/run_board.hpp"

namespace takt::attach {

/// The parameters of a run that do not have the value of the graph's file:
/// [{"node": "cruise", "param": "speed", "value": 0.2, "unit": "m/s", "from": "set", "at_s": 3.1, "by_user": 1000,
///   "taken_up": 1}]. `from`: "set" (`takt set`, live; the last three keys belong to it, else they are null), "kept"
///   (an
/// overlay), "command line" (--set). `taken_up`: how often a restarted process took a value of it up. Any thread.
nlohmann::ordered_json parameters_json(const NodeTypes& types, const graph::GraphSpec& graph, const Plan& plan,
                                       const RunBoard& board);

/// The value that a parameter has now, in the same form; its `from` may also be "file". `param`: index into
/// Node::params().
nlohmann::ordered_json parameter_json(const NodeTypes& types, const graph::GraphSpec& graph, const Plan& plan,
                                      const RunBoard& board, size_t task, size_t param);

/// "cruise.speed 0.2 m/s (set at 3.1 s, taken up once after a restart)"
std::string parameter_text(const nlohmann::ordered_json& parameter);

}  // namespace takt::attach
