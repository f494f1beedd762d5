// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "hal/settings/json.hpp"

namespace takt::command {

/// The verdict of a run as JUnit XML, which CI servers show: one test case for each promise, and for each one that was
/// broken what was expected and what was seen.
///
///   takt run graph.yaml --junit result.xml
///
/// What a graph expects, or a scenario of faults, decides the run, and is the list; a run without either has one case
/// for each node (no deadline missed if it is a high one, all releases completed but one). The proofs are one more.
/// A case fails exactly where the exit code of the run has a reason. Pure.
std::string junit_text(const nlohmann::ordered_json& report);

}  // namespace takt::command
