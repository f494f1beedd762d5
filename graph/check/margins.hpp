// SPDX-License-Identifier: Apache-2.0
// How far a plan is from the edge of what is admitted, found by asking the same admission again with changed figures.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "graph/check/admission.hpp"

namespace takt::graph {

/// What is asked of a plan beside its admission, such as its ages and its other modes; includes the admission.
using Accepts = std::function<bool(const Plan&)>;

/// By task of an accepted plan: how much its budget alone may grow before the plan is refused, to 0.1 % of itself or a
/// microsecond. With 0.99 of it added the plan is accepted, with 1.01 of it refused.
std::vector<int64_t> margins(const Plan& plan, const analysis::Overheads& overheads, const Accepts& accepts = {});

/// One figure of the schedule that would make a refused plan fit.
struct Change {
  enum class What : uint8_t { budget, deadline, rate, cores, offset, max_age } what = What::budget;
  size_t task = kNone;
  double from = 0, to = 0;  ///< ms, Hz or a number of cores
  double relative = 0;      ///< |to - from| / from; of an offset / period
  std::string name = {};    ///< of the chain or edge whose max_age it is
};
/// The smallest by `relative` of: one budget lowered, one deadline raised (to the period at most), one rate lowered (in
/// steps of 0.1 Hz), one core more. Each was tried: with it the plan is admitted. Nothing if no single change does it.
std::optional<Change> smallest_change(const Plan& plan, const analysis::Overheads& overheads);
/// The same for a plan that is admitted but for the ages of its data, with all that is `accepted`: any figure of
/// budgets, deadlines, rates and offsets (each in eight steps to either side), and `later`, the max_age that would do.
std::optional<Change> smallest_age_change(const Plan& plan, const Accepts& accepted,
                                          const std::optional<Change>& later);
/// "lower the budget of stereo from 20 ms to 18.25 ms".
std::string to_string(const Change& change, const Plan& plan);

}  // namespace takt::graph
