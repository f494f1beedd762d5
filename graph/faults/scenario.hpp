// SPDX-License-Identifier: Apache-2.0
// A fault scenario as plain data: which faults a run is given, and what it must show all the same. The language stands
// in docs/faults.md.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "graph/faults/fault_kinds.hpp"
#include "graph/language/graph.hpp"
#include "rt/faults/message_fault.hpp"
#include "rt/shm/kill_order.hpp"

namespace takt::graph {

/// Instants count from the epoch of the run. What a kind has no use for keeps its default.
struct FaultSpec {
  FaultKind kind = FaultKind::drop;
  std::string target;                             ///< "" where the kind has none
  int64_t from_ns = 0, to_ns = faults::kForever;  ///< [from, to)
  MessageStep step = MessageStep::none;           ///< of kill_at_step
  std::string reader;    ///< of kill_at_step: the node whose process it is, if not the writer's
  int64_t at_ns = 0;     ///< of hang, kill, kill_at_step, stop_process
  int64_t every_ns = 0;  ///< of kill: > 0: at from, from + every ... before to, instead of at
  int64_t for_ns = 0;    ///< of hang (0: never returns), kill, stop_process
  int64_t by_ns = 0;
  double probability = 1;
  uint32_t threads = 1;
  bool fixed_policy = false;  ///< of cpu_hog
  uint64_t bytes = 0;         ///< of memory_hog, full_disk
  uint64_t bytes_per_s = 0;   ///< of slow_disk
  Position position;

  /// When it begins and when nothing of it is left to strike; kForever: it lasts.
  int64_t begins_ns() const;
  int64_t ends_ns() const;
};

/// What is not stated is not asked for, but for what verdict() always asks for.
struct Expectations : FigureExpectations {
  std::map<std::string, Bound> restarts;  ///< by subsystem
  std::optional<int64_t> recovery_ns;     ///< after the end of each fault
  std::optional<Bound> lost;              ///< messages
  std::optional<int> exit;                ///< of the run, had it no scenario
};

struct Scenario {
  std::string name, file;
  uint64_t seed = 1;
  std::vector<FaultSpec> faults;
  Expectations expect;
};

/// What a run offers a scenario.
struct RunKind {
  bool virtual_time = false;
  bool processes = false;  ///< one per subsystem
  bool records = false;
  bool iceoryx = false;  ///< carries the messages
};

struct LoadedScenario {
  std::optional<Scenario> scenario;  ///< present exactly if there is no problem
  std::vector<Problem> problems;
};

/// Reads a scenario and checks all of it against the graph, `plan` being its outline or more: syntax, schema, targets,
/// the keys that each kind takes, times, and whether such a run can have the faults. Every problem, in their order.
LoadedScenario load_scenario(const std::filesystem::path& file, const GraphSpec& graph, const Plan& plan,
                             const RunKind& run);

/// A window in which a device fails. For the drivers.
struct DeviceFailure {
  std::string device;
  FaultKind kind = FaultKind::silent;  ///< silent, unplugged, garbage or frozen
  int64_t from_ns = 0, to_ns = 0;      ///< [from, to), since the epoch
  bool operator==(const DeviceFailure&) const = default;
};
std::vector<DeviceFailure> device_failures(const Scenario& scenario);

/// Subsystem of a node or device ("devices"); a subsystem's own name; "" if there is no such thing.
std::string process_of(const GraphSpec& graph, const std::string& id);
/// The subsystems, and "devices" if there are any.
std::vector<std::string> processes_of(const GraphSpec& graph);

}  // namespace takt::graph
