// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

ResponseBounds fixed_priority_responses(const std::vector<TimedTask>& tasks);

}  // namespace takt::analysis
