// SPDX-License-Identifier: Apache-2.0
// What one parameter does to the errors of a drive.
#pragma once
#include <string>
#include <vector>

#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {

std::vector<std::string> sweep_names();

/// The recorded drive, or the generated one that drives and turns, with each value of the parameter `options.sweep`.
/// Its curves go to `options.picture`, if that is named.
nlohmann::ordered_json measure_sweep(const EvalEgoMotionOptions& options);
void print_sweep(const nlohmann::ordered_json& table);

}  // namespace takt::command
