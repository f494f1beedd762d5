// SPDX-License-Identifier: Apache-2.0
// `takt machine show | apply | undo`: what a machine file sets on this computer, or in a folder that becomes an image.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>

namespace takt::command {

struct MachineOptions {
  std::filesystem::path file;
  std::filesystem::path root = "/";
  bool json = false;
};

/// Adds the command. Exit 0: done; 2: a machine file that is wrong; 3: a file cannot be written.
void add_machine(CLI::App& app, MachineOptions& options, int& exit_code);

}  // namespace takt::command
