// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/outcome.hpp"

#include <cstdio>
#include <cstdlib>

namespace takt::command {

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

std::filesystem::path shipped(const std::filesystem::path& relative) {
  if (const char* home = std::getenv("TAKT_HOME")) return std::filesystem::path(home) / relative;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto installed = program.parent_path().parent_path() / "share/takt" / relative;
  return std::filesystem::exists(installed, error) ? installed : relative;
}

}  // namespace takt::command
