// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "hal/settings/json.hpp"
#include "rt/machine/finding.hpp"
#include "rt/machine/identity.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// The findings for people, at most 80 columns wide but for a file name that is longer itself. A command that is longer
/// than a line goes on behind a backslash, so that it can be copied as it stands.
std::string doctor_text(const machine::Identity& machine, const std::vector<machine::Finding>& findings);

/// What a run under that policy lacks here, with the fixes; "" if nothing. For --require-rt. Before this process has
/// any thread.
std::string lacks_text(Policy policy, bool over_iceoryx);

/// {"machine", "checks": [{"group", "name", "status", "found", "meaning", "fixes": [{"where", "text"}]}], "counts"}.
nlohmann::ordered_json doctor_json(const machine::Identity& machine, const std::vector<machine::Finding>& findings);

}  // namespace takt::graph
