// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string_view>

namespace takt::command {

/// The file of takt-NAME: in libexec/takt of the installation, else beside this program, else in PATH. Empty if there
/// is none.
std::filesystem::path other_program(std::string_view name);

/// That of `takt` itself, for such a program.
std::filesystem::path takt_program();

}  // namespace takt::command
