// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "rt/record/log_file.hpp"

namespace takt::log {

/// What of a record could not be read, for an error or a warning: "run.mcap is not whole: no end (and 2 more)"; "" of a
/// whole one.
std::string damages_text(const std::filesystem::path& file, const record::LogFile& log);

}  // namespace takt::log
