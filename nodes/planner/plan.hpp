// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/planner/domain.hpp"
#include "rt/state_archive.hpp"

namespace takt::planner {

struct Step {
  uint32_t action = 0;  ///< of Domain::actions
  int64_t drive_ns = 0, action_ns = 0;
};

enum class Verdict : uint8_t {
  best,     ///< no plan costs less
  found,    ///< the best so far; the search ended early, or does not look for the best
  none,     ///< there is no plan
  gave_up,  ///< none so far; the search ended early
};

/// Sigma and the list of Phi (thesis Eq. 5.21). Nothing to do: cost 0, no steps.
struct Plan {
  Verdict verdict = Verdict::none;
  int64_t cost_ns = -1;  ///< -1: no plan
  int64_t bound_ns = 0;  ///< no plan costs less than this
  std::vector<Step> steps;
  size_t expanded = 0;  ///< states, or candidates of the recursion
  bool exists() const { return cost_ns >= 0; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, verdict, cost_ns, bound_ns, steps, expanded); }
};

/// When a search ends early.
struct Effort {
  size_t expansions = 100'000;
  std::function<bool()> time_is_up;  ///< asked before each; none: never
};

constexpr size_t kMostSteps = 256;

/// One line a step, what it costs, and the sum: "1. fill(target cup_1, source bottle_2): drive 3.1 s, act 6.0 s".
std::string to_text(const semantic::SemanticMap& map, const Domain& domain, const Plan& plan);

}  // namespace takt::planner
