// SPDX-License-Identifier: Apache-2.0
// The kinds of faults, each with what it strikes, the keys it takes and the runs it can be given. The one table of it.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace takt::graph {

enum class FaultKind : uint8_t {
  // of the messages of an output
  drop,
  delay,
  duplicate,
  corrupt,
  truncate,
  freeze,
  reorder,
  clock_step,
  exhausted_pool,
  // of jobs and processes
  slow_consumer,
  hang,
  kill,
  kill_at_step,
  stop_process,
  // of the machine
  cpu_hog,
  memory_hog,
  slow_disk,
  full_disk,
  // of devices
  silent,
  unplugged,
  garbage,
  frozen,
};

enum class FaultTarget : uint8_t { none, output, node, process, device };

struct FaultKindInfo {
  FaultKind kind;
  std::string_view name;
  FaultTarget target;
  std::vector<std::string_view> required, optional;  ///< keys beside kind and target
  bool in_virtual_time;                              ///< else only in real time
  bool in_one_process;                               ///< in real time; else only where each subsystem is a process
  bool needs_record;
};

/// In the order of FaultKind.
std::span<const FaultKindInfo> fault_kinds();
const FaultKindInfo& info(FaultKind kind);
/// Null if there is none of that name.
const FaultKindInfo* find_fault_kind(std::string_view name);
/// Strikes messages on their way from a node to its output.
bool strikes_messages(FaultKind kind);
/// Ends or stops a process.
bool strikes_processes(FaultKind kind);

}  // namespace takt::graph
