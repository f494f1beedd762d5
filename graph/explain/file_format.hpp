// SPDX-License-Identifier: Apache-2.0
// The formats of what a run writes as JSON. A file says its own in the key `format`: a report at its top, a trace in
// `otherData`. Files without the key are of format 1. docs/versions.md has what may change within a format.
#pragma once
#include <optional>
#include <string>

#include "hal/settings/json.hpp"

namespace takt::explain {

inline constexpr int kReportFormat = 1, kTraceFormat = 1;

/// If `head` says a format above `known`: why this program does not read the file, without the file's name.
std::optional<std::string> later_format(const nlohmann::ordered_json& head, int known);

}  // namespace takt::explain
