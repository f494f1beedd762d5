// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace takt::command {

struct CalibrateOptions {
  std::filesystem::path folder;
  std::string board = "9x6";  ///< inner corners
  double square_m = 0;        ///< 0: not known
  std::string left = "left*.jpg", right = "right*.jpg";
  std::filesystem::path out, picture;
  bool json = false;
};

/// `takt calibrate stereo`: from pictures of a chessboard to a calibration of both cameras. 0 done, 2 bad input. stdout
/// carries the table, or with --json one object and nothing else.
void add_calibrate(CLI::App& app, CalibrateOptions& options, int& exit_code);

}  // namespace takt::command
