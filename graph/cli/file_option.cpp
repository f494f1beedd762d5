// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/file_option.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "rt/file/output_file.hpp"

namespace takt::command {
namespace {

namespace fs = std::filesystem;

template <class Why>
CLI::Option* named(CLI::Option* option, const char* kind, const Why& why) {
  option->type_name(kind);
  return option->check([why](const std::string& text) {
    const std::string reason = why(fs::path(text));
    return reason.empty() ? "" : fmt::format("{} {}", text, reason);
  });
}

std::string why_unwritable(const fs::path& file) {
  const auto claimed = OutputFile::claim(file);
  return claimed ? "" : claimed.error().what.substr(file.string().size() + 2) + "; choose another place";
}

/// Of the next folder above it that is there.
std::string why_no_new_folder(const fs::path& folder) {
  std::error_code none;
  fs::path there = fs::absolute(folder, none).lexically_normal();
  while (!fs::exists(there, none) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, none))
    return there == folder ? "is no folder, a folder is expected"
                           : fmt::format("cannot be made: {} is no folder", there.string());
  return access(there.c_str(), W_OK | X_OK) == 0 ? "" : fmt::format("cannot be written: {}", std::strerror(errno));
}

}  // namespace

CLI::Option* reads_file(CLI::Option* option, uint64_t most_bytes) {
  return named(option, "FILE", [most_bytes](const fs::path& file) { return why_unreadable(file, most_bytes); });
}

CLI::Option* reads_folder(CLI::Option* option) {
  return named(option, "FOLDER", [](const fs::path& folder) { return why_unreadable_folder(folder); });
}

CLI::Option* writes_file(CLI::Option* option) {
  return named(option, "NEW-FILE", [](const fs::path& file) { return why_unwritable(file); });
}

CLI::Option* writes_folder(CLI::Option* option) {
  return named(option, "NEW-FOLDER", [](const fs::path& folder) { return why_no_new_folder(folder); });
}

}  // namespace takt::command
