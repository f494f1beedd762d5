// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace takt::command {

/// `takt devices`: what is plugged in, which driver fits, and a line for the graph file. 0, also when there is nothing.
/// stdout carries the table, or with `json` one array and nothing else. `root`: where sysfs is looked for.
int list_devices(bool json, const std::filesystem::path& root = "/");

}  // namespace takt::command
