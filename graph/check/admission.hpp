// SPDX-License-Identifier: Apache-2.0
// Whether every job of a plan meets its deadline, decided before anything starts.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "graph/check/policy_analysis.hpp"
#include "rt/sched/analysis/overheads.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

struct NodeAdmission {
  std::optional<int64_t> response_ns = {};  ///< bound, from its planned release to its published output
  /// Bounds from the planned release of its lane's head: of the instant at which it takes its inputs, and of its
  /// publication (its response if it heads the lane).
  std::optional<int64_t> start_ns = {}, finish_ns = {};
};

struct Admission {
  Answer answer = Answer::not_proven;
  std::string by;                    ///< the analysis
  std::vector<std::string> reasons;  ///< why it is not admitted
  std::vector<std::string> notes;    ///< what was not asked of it, or does not hold
  std::vector<NodeAdmission> nodes;  ///< by task of the plan
};

/// Two questions, each answered by the analysis of the policy: does every job meet its deadline if all keep their
/// budgets; and do those of high criticality that keep theirs if every one of low criticality, and under `deadline` one
/// of high, runs on until it is stopped, late by the error of the enforcement? The second is not asked under
/// `cooperative`, where nothing is enforced.
/// `bounds` false leaves out what only the ages need.
Admission admit(const Plan& plan, const analysis::Overheads& overheads, bool bounds = true);

}  // namespace takt::graph
