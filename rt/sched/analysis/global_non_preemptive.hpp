// SPDX-License-Identifier: Apache-2.0
// Non-preemptive EDF of several workers over one queue (policy `cooperative`): a worker that becomes free takes the
// released job with the earliest deadline and finishes it. With so few preemption points everything depends on who is
// released when, so the exact releases are used: all schedules that execution times from 0 to the budget can lead to
// are explored at once, as a graph of states.
//
// Source: Nasri, Nelissen and Brandenburg 2018, "A Response-Time Analysis for Non-Preemptive Job Sets under Global
// Scheduling" (sufficient; on one core as exact as their earlier analysis). Pure function; any thread.
#pragma once
#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

/// Periodic tasks with offsets, from an epoch at which all workers are free; jobs of equal deadline go by the order of
/// the tasks. `schedulable` with response bounds, or `not_proven` with the reason: a job that may be late, sporadic
/// tasks, more than 20,000 jobs or `max_states` states, or no instant in a hyperperiod at which all work is surely done
/// (only from such an instant on everything repeats).
CoreAnalysis global_non_preemptive_edf(const TaskSet& set, size_t max_states = 100'000);

}  // namespace takt::analysis
