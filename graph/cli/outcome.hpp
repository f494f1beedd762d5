// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "rt/file/output_file.hpp"

namespace takt::command {

/// Exit codes of every takt command.
enum Exit : int { kOk = 0, kNotOk = 1, kBadInput = 2, kDeviceOrSystem = 3 };

/// Writes one error to stderr and returns the code.
int refuse(const std::string& text, Exit code);

/// The same of a file that was not written: bad input where another name would do.
int refuse(const OutputFailure& failure, const std::string& option);

/// Writes a file whole (rt/file/output_file.hpp); why it could not is on stderr then. The exit code.
int write_output(const std::filesystem::path& file, std::string_view content, const std::string& option);

/// A file or folder that Takt ships with (graph/language/share.hpp).
std::filesystem::path shipped(const std::filesystem::path& relative);

}  // namespace takt::command
