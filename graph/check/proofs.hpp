// SPDX-License-Identifier: Apache-2.0
// What was admitted, as it goes with the run that it admits: bounds to be compared with what is seen, and the
// assumptions under which they hold.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "graph/check/check.hpp"

namespace takt::graph {

/// A bound, or why there is none.
struct Proven {
  std::optional<int64_t> bound_ns;
  std::string why;
};

/// Bounds of one mode.
struct ModeProofs {
  std::vector<Proven> responses;  ///< by task of the whole plan
  std::vector<AgeBound> ages;     ///< of chains, and of edges with a max_age
};

struct Proofs {
  Policy policy = Policy::cooperative;  ///< under which they hold: the one that was asked for
  std::vector<ModeProofs> modes;        ///< as Plan::modes, the first one that of the start; empty: nothing is proven
  std::string why;                      ///< why nothing is proven
  OverheadBasis basis = OverheadBasis::assumed;
  std::string overheads_from;  ///< one line
  /// How long the machine may be away from a job: what is charged for getting it going. Nothing is charged beyond it.
  int64_t stall_ns = 0;

  /// Of a task, a chain, an edge ("producer.port -> consumer.input") in that mode. Without a bound: `why`.
  Proven response(size_t mode, size_t task) const;
  Proven chain(size_t mode, const std::string& name) const;
  Proven edge(size_t mode, const std::string& name) const;

 private:
  Proven age(size_t mode, bool edge, const std::string& name) const;
};

/// The proofs of a check that went on: empty if it admitted nothing.
Proofs proofs_of(const Plan& plan, const CheckResult& check, const CheckMachine& machine);

/// Chance that of `samples` at least `above` lie above a bound that each may exceed with probability `share`, if they
/// do not depend on one another: the tail of the binomial distribution. `share` in (0, 1).
double chance_of(uint64_t above, uint64_t samples, double share);

}  // namespace takt::graph
