// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "graph/run/run.hpp"

namespace takt::command {

struct ProfileOptions {
  RunOptions run;  ///< graph, what to load, how long each of the two passes lasts, seed
  double quantile = 0.99, margin = 1.2;
  std::filesystem::path write;    ///< a copy of the schedule with the budgets
  bool in_place = false;          ///< into the schedule itself
  bool keep_budgets = false;      ///< of what would be written only the block `measured`
  std::filesystem::path compare;  ///< schedule to be compared with
  std::string tolerance = "20%";
};

/// `takt profile`: measures the execution time of every node, alone and together, and writes budgets, or compares with
/// those of a schedule. Runs in one process. 0 measured (and within the tolerance), 1 above it, or stopped by a signal.
///
/// Alone: one worker runs all jobs one after the other, cooperatively, so that no other job of the graph runs at the
/// same time or interrupts; producers run before their readers as ever. So caches are as the others' jobs left them, as
/// they are in the run, and inputs are real ones. Together: as the schedule says, on all of its
/// cores and under its policy, with budgets large enough not to throttle what is being measured. In both passes a job
/// may finish late and nothing degrades.
int profile_graph(const Registry& registry, const ProfileOptions& options);

}  // namespace takt::command
