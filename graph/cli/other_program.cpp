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

std::filesystem::path own_folder() {
  std::error_code unreadable;
  return std::filesystem::read_symlink("/proc/self/exe", unreadable).parent_path();
}

std::vector<std::filesystem::path> program_folders() {
  const std::filesystem::path beside = own_folder();
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

std::filesystem::path takt_program() {
  const std::filesystem::path beside = own_folder();
  const bool installed = beside.filename() == "takt" && beside.parent_path().filename() == "libexec";
  return (installed ? beside.parent_path().parent_path() / "bin" : beside) / "takt";
}

}  // namespace takt::command
