// SPDX-License-Identifier: Apache-2.0
// What the kernel would grant a run now. It says something of the machine at this moment and nothing of the plan: it is
// no part of any verdict.
#pragma once
#include <optional>
#include <string>

#include "hal/settings/json.hpp"
#include "rt/sched/bandwidth.hpp"

namespace takt::graph {

/// "grantable: 1.050 of 1.800 cores free now; held by takt (pid 12, 9 threads) 0.750", a line.
std::string grantable_text(const std::optional<DeadlineBandwidth>& found);
/// {"free", "of", "lost", "held": [{"process", "pid", "threads", "cores"}]}; null where nothing is found.
nlohmann::ordered_json grantable_json(const std::optional<DeadlineBandwidth>& found);

}  // namespace takt::graph
