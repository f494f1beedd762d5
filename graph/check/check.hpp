// SPDX-License-Identifier: Apache-2.0
// What can be known of a composed graph before it starts.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/drivers.hpp"
#include "rt/node.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Valid: as the files say. Adjusted: it goes on, but not as the files say. Invalid: nothing starts (exit 2).
enum class Verdict : uint8_t { valid, adjusted, invalid };
std::string_view to_string(Verdict verdict);

/// Memory of one output.
struct PoolUse {
  std::string output;  ///< node.port
  uint32_t chunks = 0;
  uint64_t bytes = 0;  ///< of the whole pool
};

/// Load of one core if the tasks are put on cores the largest first, each where most is free. An illustration where
/// jobs may run on any core.
struct CoreUse {
  int core = 0;
  double utilisation = 0;
};

/// Load and memory of a plan. Utilisation is sum(budget * rate) over the cores of the schedule; response times are not
/// analysed yet, so `admitted` says that the work fits on average, not that every deadline is proven.
struct CheckResult {
  Verdict verdict = Verdict::valid;
  bool admitted = false;
  double utilisation = 0;  ///< cores wanted
  size_t cores = 0;
  uint64_t pool_bytes = 0;
  std::vector<std::string> unbudgeted;  ///< tasks whose budget is not stated: not counted
  std::vector<std::string> notes;       ///< what is admitted and yet a risk
  std::vector<std::string> problems;    ///< why it is not admitted: the task, the value, what would make it fit
  std::vector<PoolUse> pools;
  std::vector<CoreUse> core_use;
  std::string text;  ///< table for people, the reason first if not admitted
  nlohmann::ordered_json json;
};

CheckResult check(const GraphSpec& graph, const Plan& plan);
/// The result for input that could not be loaded: Invalid, one line per problem.
CheckResult check_failed(const std::vector<Problem>& problems);

/// `takt nodes`: every device kind with its drivers; drivers and settings of one.
std::string devices_text();
std::string device_text(const hal::DeviceKind& kind);
/// `takt nodes`: every type with its layer and purpose.
std::string nodes_text(const NodeTypes& types);
/// `takt nodes TYPE`: ports with message types, parameters with default, unit, range and meaning.
std::string node_text(const NodeType& type);

}  // namespace takt::graph
