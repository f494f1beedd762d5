// SPDX-License-Identifier: Apache-2.0
// What `takt profile` makes of measured execution times. Pure; the measuring itself is in profile_command.cpp.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "rt/sched/histogram.hpp"

namespace takt::command {

/// Execution times of one node: CPU time of its thread per job, wake-up and latching included.
struct NodeProfile {
  std::string name;
  Histogram alone, together;
  int64_t budget_ns = 0;  ///< of the schedule; 0: not stated
  uint64_t samples() const { return alone.count() + together.count(); }
  /// The larger of both quantiles; 0 without samples.
  int64_t quantile_ns(double quantile) const;
  /// Whether each of the passes that has samples has enough for that quantile to be another than the largest.
  bool enough_for(double quantile) const;
};

/// margin * quantile for each node that ran, ns.
std::map<std::string, int64_t> budgets_of(const std::vector<NodeProfile>& nodes, double quantile, double margin);

/// How one node compares with a schedule that was measured before.
struct Drift {
  std::string name;
  int64_t measured_ns = 0;
  int64_t stored_ns = 0, budget_ns = 0;  ///< 0: the schedule does not say
  bool measured = true;                  ///< false: no job ran
  bool above_stored = false, above_budget = false;
  bool ok() const { return !above_stored && !above_budget; }
};
/// By more than `tolerance` (0.2: a fifth) above the stored quantile, or above the budget.
std::vector<Drift> drift_of(const std::vector<NodeProfile>& nodes, const graph::ScheduleSpec& schedule, double quantile,
                            double tolerance);

/// Tables for people, 80 columns.
std::string profile_text(const std::vector<NodeProfile>& nodes, double quantile, double margin);
std::string drift_text(const std::vector<Drift>& drifts, double tolerance);

/// "20%" or "0.2" -> 0.2; nothing if it is neither, or negative.
std::optional<double> parse_tolerance(const std::string& text);

}  // namespace takt::command
