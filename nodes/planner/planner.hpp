// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/planner/recursion.hpp"
#include "nodes/planner/search.hpp"

namespace takt::planner {

enum class Method : uint8_t {
  best,       ///< the recursion for a first plan, then A* for the best
  recursive,  ///< the thesis's, as it is
};

struct PlannerParameters {
  Method method = Method::best;
  RecursionParameters recursion;
  SearchCapacity search;
};

/// Anytime: a plan is there after the recursion, and better or proved the best after the search. Memory is taken by the
/// constructor. One thread at a time.
class Planner {
 public:
  explicit Planner(const PlannerParameters& parameters)
      : method_(parameters.method), recursion_(parameters.recursion), search_(parameters.search) {}

  Plan plan(const Domain& domain, const Effort& effort = {}) {
    const Plan first = recursion_.find(domain, effort);
    return method_ == Method::recursive ? first : search_.find(domain, effort, first);
  }

  /// The same in portions, each with an effort of its own; the recursion is the first. The domain stays until the end.
  void begin(const Domain& domain, const Effort& effort) { search_.begin(domain, recursion_.find(domain, effort)); }
  /// True once it is over.
  bool go_on(const Effort& effort) { return method_ == Method::recursive || search_.go_on(effort); }
  const Plan& best_so_far() const { return search_.plan(); }
  void remember(StateArchive& archive, const Domain& domain) { search_.remember(archive, domain); }

 private:
  Method method_;
  Recursion recursion_;
  Search search_;
};

}  // namespace takt::planner
