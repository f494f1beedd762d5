// SPDX-License-Identifier: Apache-2.0
// What was proven of a run beside what was seen of it.
#pragma once
#include <string>
#include <vector>

#include "graph/check/proofs.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/stall_watch.hpp"

namespace takt::command {

/// Why a sample may lie above its bound. Each but the last is an assumption of the proof that did not hold.
enum class ExcessCause : uint8_t {
  quantile,        ///< the overheads are 99th percentiles, and no more than one sample in a hundred is above
  host_stall,      ///< the machine was away for longer than assumed
  restart,         ///< a process of the run was away
  budget_overrun,  ///< a job used more than its budget
  mode_change,     ///< of an age: producers began or ended
  double_late,     ///< of an age: what plays the device on this machine was late by as much
  no_message,      ///< of an age: a job on the way published nothing
  unexplained,
};
std::string_view to_string(ExcessCause cause);

/// A run that has ended.
struct ProofFacts {
  const graph::GraphSpec& graph;
  const Plan& plan;
  const RunBoard& board;
  const graph::Proofs& proofs;
  const StallLog& stalls;
  const RunResult& result;
  bool virtual_time = false;
};

/// Tells the board the bounds of the mode of the start, so that samples above them are noted. Before the epoch.
void tell_bounds(const graph::GraphSpec& graph, const Plan& plan, const graph::Proofs& proofs, RunBoard& board);

/// Judges what the board noted. A sample taken in another mode than that of the start is compared with the larger bound
/// of all modes that the run was in.
class ProofReport {
 public:
  explicit ProofReport(const ProofFacts& facts);

  /// What stands beside `max` of a figure: {"proven_ms"}; where that is null {"not_proven": why}, under `cooperative`
  /// {"estimated_ms"} as well.
  nlohmann::ordered_json of_response(size_t task) const;
  nlohmann::ordered_json of_edge(size_t task, size_t edge) const;
  nlohmann::ordered_json of_chain(const std::string& name) const;

  /// The report's "proofs": {"verdict": held | assumption_broken | unexplained | none, "why", "assumptions", "stalls",
  /// "compared", "above_proof": [...]}.
  nlohmann::ordered_json json() const;
  bool unexplained() const;

 private:
  /// Samples of one figure above its bound, for one cause.
  struct Row {
    Excess largest;
    ExcessCause cause = ExcessCause::unexplained;
    int64_t bound_ns = 0, stall_ns = 0;
    int64_t without_stalls_ns = 0;  ///< the largest kept sample, each less the stalls within it
    uint64_t samples = 0, of = 0;
    double chance = 0;  ///< that so many or more are above a 99th percentile
  };

  /// What the board has of a sample's figure.
  struct Kept {
    const ProofBound& bound;
    const Histogram& samples;
  };

  bool compared() const { return not_compared_.empty(); }
  graph::Proven largest(const std::function<graph::Proven(size_t)>& of_mode) const;
  graph::Proven bound_of(const Excess& sample) const;
  nlohmann::ordered_json beside_max(const graph::Proven& proven) const;
  std::vector<Row> rows_of(const std::vector<Excess>& samples) const;
  ExcessCause cause_of(const Excess& sample, int64_t bound_ns) const;
  bool names_a_figure(const Excess& sample) const;
  bool overran(int64_t from_ns, int64_t to_ns) const;
  bool restarted(int64_t from_ns, int64_t to_ns) const;
  bool changed_mode(int64_t from_ns, int64_t to_ns) const;
  bool double_late(const Excess& sample, int64_t bound_ns) const;
  bool message_missing(const Excess& sample) const;
  bool silent(size_t task, size_t port) const;
  int64_t begin_ns(const Excess& sample) const { return sample.at_ns - sample.observed_ns - lookback_ns_; }
  Kept kept_of(const Excess& sample) const;
  std::string name_of(const Excess& sample) const;
  uint64_t figures() const;

  const ProofFacts facts_;
  std::string not_compared_;   ///< why; "": it is
  std::vector<size_t> modes_;  ///< that the run was in, the first one that of the start
  int64_t lookback_ns_ = 0;    ///< a backlog is worked off within it
  std::vector<Row> rows_;
};

/// Of the report's "proofs": lines for what nothing explains; the lines for all else that is above, and the verdict.
std::string unexplained_text(const nlohmann::ordered_json& proofs);
std::string proofs_text(const nlohmann::ordered_json& proofs);

}  // namespace takt::command
