// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace takt::command {

/// Exit codes of every takt command.
enum Exit : int { kOk = 0, kNotOk = 1, kBadInput = 2, kDeviceOrSystem = 3 };

/// Writes one error to stderr and returns the code.
int refuse(const std::string& text, Exit code);

/// A file or folder that the command ships with: beside the launcher, or in share/takt beside an installed bin/.
std::filesystem::path shipped(const std::filesystem::path& relative);

}  // namespace takt::command
