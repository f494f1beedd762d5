// SPDX-License-Identifier: Apache-2.0
// What can be known of a composed graph before it starts.
#pragma once
#include <string>
#include <vector>

#include "graph/check/admission.hpp"
#include "graph/check/ages.hpp"
#include "graph/check/check_machine.hpp"
#include "graph/check/network.hpp"
#include "graph/language/graph.hpp"
#include "hal/device_types.hpp"
#include "hal/settings/json.hpp"
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

/// What is found out of one mode: the whole plan, or what is left of it.
struct ModeCheck {
  std::string mode;
  Admission admission;
  std::vector<std::string> tasks;   ///< names, in the order of the admission's nodes
  std::vector<int64_t> margins_ns;  ///< by task if admitted and asked for
  std::string change;               ///< the smallest single one that would make it fit; "" if none or admitted
  int64_t change_within_ns =
      0;  ///< from asking for it: then no job of another mode runs, and each of its own has begun
  std::vector<AgeBound> ages;
  std::vector<std::string> problems;  ///< why it is refused, ages included
};

/// What is known of a plan before it starts. Invalid: the files ask for something that no run could do (exit 2).
struct CheckResult {
  Verdict verdict = Verdict::valid;
  Answer answer = Answer::not_proven;  ///< the worst of all modes
  bool admitted = false;
  OverheadBasis basis = OverheadBasis::assumed;  ///< of the overheads that `modes` are charged
  analysis::Overheads charged = {};              ///< these
  double utilisation = 0;                        ///< cores wanted: sum of budget * rate
  size_t cores = 0;
  uint64_t pool_bytes = 0;
  std::vector<std::string> unbudgeted;  ///< tasks whose budget is not stated: not counted
  std::vector<std::string> notes;       ///< what is admitted and yet a risk
  std::vector<std::string> warnings;    ///< figures that were measured elsewhere
  std::vector<std::string> problems;    ///< why it is not admitted: the task, the value, what would make it fit
  std::vector<PoolUse> pools;
  std::vector<CoreUse> core_use;
  std::optional<NetworkCheck> network = {};  ///< of the part of a machine
  std::vector<ModeCheck> modes;              ///< that of the start first, then all others that the run can change to
  int64_t bandwidth_within_ns =
      0;             ///< after a process died: what its threads had of SCHED_DEADLINE is there again; 0: none
  std::string text;  ///< for people, the reason first if not admitted
  nlohmann::ordered_json json;
};

struct CheckOptions {
  CheckMachine machine = {};
  bool margins = false;   ///< costs some hundred admissions
  bool real_time = true;  ///< false: virtual time, in which the machine's cores do not matter
};

/// Admission, ages and memory of a plan in each of its modes. With the worst overheads that were observed if these
/// admit it, else with the others.
CheckResult check(const GraphSpec& graph, const Plan& plan, const CheckOptions& options = {});
/// The plan without these tasks; who followed one of them is left out as well.
Plan without(const Plan& plan, const std::vector<std::string>& names);
/// The result for input that could not be loaded: Invalid, one line per problem.
CheckResult check_failed(const std::vector<Problem>& problems);

/// `takt nodes`: every device kind with its drivers; drivers and settings of one.
std::string devices_text(const hal::DeviceTypes& types);
std::string device_text(const hal::DeviceKind& kind);
/// `takt nodes`: every type with its layer and purpose.
std::string nodes_text(const NodeTypes& types);
/// `takt nodes TYPE`: ports with message types, parameters with default, unit, range and meaning.
std::string node_text(const NodeType& type);

}  // namespace takt::graph
