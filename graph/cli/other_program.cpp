// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/other_program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

namespace takt::command {
namespace {

std::vector<std::filesystem::path> program_folders() {
  std::error_code unreadable;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", unreadable).parent_path();
  std::vector<std::filesystem::path> folders{beside.parent_path() / "libexec/takt", beside};
  const char* path = std::getenv("PATH");
  std::istringstream parts(path != nullptr ? path : "");
  for (std::string part; std::getline(parts, part, ':');) folders.emplace_back(part.empty() ? "." : part);
  return folders;
}

}  // namespace

std::filesystem::path other_program(std::string_view name) {
  if (name.empty() || name.find('/') != std::string_view::npos) return {};
  for (const auto& folder : program_folders()) {
    auto program = folder / fmt::format("takt-{}", name);
    std::error_code ignored;
    if (std::filesystem::is_regular_file(program, ignored) && access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

}  // namespace takt::command
