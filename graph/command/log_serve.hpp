// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>

namespace takt::command {

struct LogServeOptions {
  std::filesystem::path folder;
  double for_s = 0;  ///< 0: until the run ends
};

/// `takt log serve FOLDER`: what a run keeps, as one record on stdout, while it runs. Exit 0, also if the reader goes;
/// 1 if the record has gaps, 2 if no run keeps a ring there, 3 if stdout does not take it.
int log_serve(const LogServeOptions& options);

void add_log_serve(CLI::App& log, LogServeOptions& options, int& exit_code);

}  // namespace takt::command
