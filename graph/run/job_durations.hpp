// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "rt/sched/plan.hpp"

namespace takt::command {

/// How long a job of that task is taken to need in virtual time at full quality, ns. Empty: its budget.
using JobDurations = std::function<int64_t(size_t task, uint64_t job)>;

/// What `--durations` asks for: `budgets`; `random`, evenly between half the budget and the whole, the same for the
/// same seed, node and job; else a record, whose jobs' execution times are taken (each divided by the cost of its
/// level; from the first one again where there are no more; the budget of a node that had none, because it runs only on
/// request). Error: no readable record, or one that does not know a node.
tl::expected<JobDurations, std::string> job_durations(const std::string& how, const Plan& plan, uint64_t seed);

/// The shortest time at full quality that comes to `cpu_ns` at a level of that cost, as Task::begin works it out.
int64_t at_full_quality_ns(int64_t cpu_ns, double cost);

}  // namespace takt::command
