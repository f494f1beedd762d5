// SPDX-License-Identifier: Apache-2.0
// `takt cloud FILE...`: the operations of nodes/cloud on PLY and PCD files.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/cloud/cloud_filter.hpp"

namespace takt::command {

struct CloudOptions {
  std::vector<std::filesystem::path> files;
  std::string outliers;  ///< "RADIUS:OTHERS"
  cloud::FilterSteps steps;
  std::filesystem::path out;
  bool ascii = false, json = false;
};

/// Adds the command; it sets the exit code: 0 done, 2 bad input.
void add_cloud(CLI::App& app, CloudOptions& options, int& exit_code);

}  // namespace takt::command
