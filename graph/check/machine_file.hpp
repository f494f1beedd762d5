// SPDX-License-Identifier: Apache-2.0
// What a check knows of the machine: its CPUs, and what `takt doctor --measure` found there.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/analysis/overheads.hpp"

namespace takt::graph {

struct CheckMachine {
  analysis::Overheads overheads;      ///< charged in every analysis
  bool measured = false;              ///< else assumed
  std::string overheads_from;         ///< one line: where the figures come from
  std::vector<std::string> warnings;  ///< measured elsewhere, unreadable file
  std::vector<int> online;            ///< CPUs; empty: not known, nothing is concluded from it
  /// CPUs of the exclusive cpuset that this process runs in; empty: it runs in none.
  std::vector<int> exclusive;
};

/// Where the figures were measured; compared word by word.
struct MachineName {
  std::string cpu, kernel;
  int cores = 0;
  bool operator==(const MachineName&) const = default;
};

/// TAKT_MACHINE, else XDG_CACHE_HOME/takt/machine.json, else ~/.cache/takt/machine.json.
std::filesystem::path machine_file();

/// Reads that file: {"machine": {"cpu", "cores", "kernel"}, "measured_at", "release_us", "switch_us", "publish_us",
/// "take_us", "per_mb_us", "enforcement_us", "tick_us", "deadline_bandwidth"}. A key that is missing keeps the value of
/// `assumed`; a file that is not there or not readable as such gives `assumed`, the latter with a warning.
CheckMachine read_machine_file(const std::filesystem::path& file, const MachineName& here,
                               const analysis::Overheads& assumed);

/// Figures for a machine that nobody measured: generous ones for a virtual machine of two cores, a budget enforced on
/// the kernel's tick, and the bandwidth that the kernel's settings allow SCHED_DEADLINE on `cores` CPUs
/// (sched_rt_runtime_us / sched_rt_period_us, from Linux 6.12 on less 5 % for the fair server).
analysis::Overheads assumed_overheads(size_t cores);

/// All of it for the machine this runs on.
CheckMachine this_machine();

}  // namespace takt::graph
