// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

struct Partition {
  /// schedulable: `set` has a core for every task, and every core meets its deadlines. not_schedulable: no assignment
  /// does. not_proven: none found, and not all tried or a test on the way was only sufficient.
  Verdict verdict = Verdict::not_proven;
  TaskSet set = {};      ///< as given where nothing was found
  std::string why = {};  ///< one sentence, empty if schedulable
};

/// Gives each task without a core one of [0, cores), keeping the cores that are given; set.cores becomes `cores`.
/// Priorities are not changed (see assign_deadline_monotonic).
///
/// By decreasing density (budget / deadline), with the per-core test of the policy deciding what fits (exact tests as
/// in Baruah & Fisher 2006): each task on the core with the least work that takes it, so that every core has something
/// left; where that fails on the first core that takes it (Lopez, Diaz & Garcia 2004). Where both fail and at most
/// kFewTasks tasks are free, all assignments in depth-first order: a core that fails stays failing with more tasks,
/// and of several empty cores one stands for all. Deterministic; at most kMostTests tests.
Partition partition(TaskSet set, int cores, CorePolicy policy);

inline constexpr size_t kFewTasks = 14;
inline constexpr int kMostTests = 20'000;

}  // namespace takt::analysis
