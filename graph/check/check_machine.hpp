// SPDX-License-Identifier: Apache-2.0
// What a check knows of the machine: its CPUs, and what `takt doctor --measure` found there.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt/machine/facts.hpp"
#include "rt/machine/identity.hpp"
#include "rt/sched/analysis/overheads.hpp"

namespace takt::graph {

/// What overheads claim: nobody measured them; one job in a hundred may take longer; none was seen to take longer, and
/// there is a margin on top.
enum class OverheadBasis : uint8_t { assumed, p99, worst };
std::string_view to_string(OverheadBasis basis);

struct CheckMachine {
  analysis::Overheads overheads;  ///< assumed, or 99th percentiles; lanes are put on cores with them
  /// The worst that was observed, and kWorstMargin of it; nothing: not known. What they admit is admitted with them.
  std::optional<analysis::Overheads> worst;
  bool measured = false;              ///< else assumed
  std::string overheads_from;         ///< one line: where the figures come from
  std::vector<std::string> warnings;  ///< measured elsewhere, a file that cannot be read
  std::vector<int> online;            ///< CPUs; empty: not known, nothing is concluded from it
  machine::Identity identity;         ///< no cores: not known
  /// CPUs of the exclusive cpuset that this process runs in; empty: it runs in none.
  std::vector<int> exclusive;
  /// One sentence if a thread in the kernel is not preempted; "": it is, or it is not known.
  std::string not_preemptible;
};

/// Of the worst overhead that was observed, so much more is charged: the next run may see a worse one.
inline constexpr double kWorstMargin = 0.2;

/// Figures for a machine that nobody measured: generous ones for a virtual machine of two cores, a budget enforced on
/// the kernel's tick, the bandwidth that the kernel's settings allow SCHED_DEADLINE on all CPUs
/// (sched_rt_runtime_us / sched_rt_period_us, from Linux 6.12 on less 5 % for the fair server), and the largest share
/// that ordinary threads have of any CPU.
analysis::Overheads assumed_overheads(const machine::Facts& facts);

/// The machine, with the overheads that `takt doctor --measure` left in `file` (machine_figures.hpp). What was not
/// measured stays as assumed; so does everything if there is no such file, or none that can be read (a warning).
CheckMachine check_machine(const machine::Facts& facts, const std::filesystem::path& file);

}  // namespace takt::graph
