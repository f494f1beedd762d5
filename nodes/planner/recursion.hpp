// SPDX-License-Identifier: Apache-2.0
// The thesis's recursive search (Alg. 5.1, corrected: ): goal by goal the action that is
// cheapest with what it requires first. Quick and not optimal (C-6).
#pragma once
#include "nodes/planner/plan.hpp"

namespace takt::planner {

struct RecursionParameters {
  int depth = 8;               ///< of requirements of requirements
  size_t orders_up_to = 4;     ///< so many goals are tried in all orders
  size_t variables = 100'000;  ///< of the domains that it will be given
};

/// Memory is taken by the constructor; find() takes none but the plan's. One thread at a time.
class Recursion {
 public:
  explicit Recursion(const RecursionParameters& parameters);

  /// Never Verdict::best. A domain with too many variables is given up. A fact that is being brought about is not
  /// pursued once more on the way: that is the guard against actions that undo each other.
  Plan find(const Domain& domain, const Effort& effort);

 private:
  struct Change {
    uint32_t variable, before;
  };
  /// Where the world stands, to come back to.
  struct Mark {
    size_t steps, trail;
    int64_t cost_ns;
    uint32_t place;
  };
  struct Candidate {
    int64_t cost_ns;
    uint32_t place;
    std::vector<Step> steps;
    std::vector<Fact> values;
  };
  bool achieve(std::span<const Fact> goals, int depth);
  bool achieve(const Fact& goal, int depth);
  bool act(uint32_t action);
  bool holds(const Fact& fact) const { return values_[fact.variable] == fact.value; }
  void set(const Fact& fact);
  void back_to(const Mark& mark);
  bool exhausted();

  RecursionParameters parameters_;
  const Domain* domain_ = nullptr;
  const Effort* effort_ = nullptr;
  std::vector<uint32_t> values_;  ///< by variable
  std::vector<Change> trail_;
  std::vector<Step> steps_;
  std::vector<Fact> open_;           ///< being brought about
  std::vector<Candidate> cheapest_;  ///< by depth
  int64_t cost_ns_ = 0;
  uint32_t place_ = 0;
  size_t tried_ = 0;
  bool gave_up_ = false;
};

}  // namespace takt::planner
