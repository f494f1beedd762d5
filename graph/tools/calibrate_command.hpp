// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>

namespace takt::command {

struct CalibrateLasersOptions {
  std::filesystem::path recording;  ///< or a sweep, or a recording to be generated
  std::string sweep;
  std::filesystem::path generate, out, picture;
  size_t runs = 20;
  uint64_t seed = 1;
  bool json = false;
};

struct CalibrateRigOptions {
  std::filesystem::path rig, out;
};

struct CalibrateOptions {
  std::filesystem::path folder;
  std::string board = "9x6";  ///< inner corners
  double square_m = 0;        ///< 0: not known
  std::string left = "left*.jpg", right = "right*.jpg";
  std::filesystem::path out, picture;
  bool json = false;
  CalibrateLasersOptions lasers;
  CalibrateRigOptions rig;
};

/// `takt calibrate stereo`: from pictures of a chessboard to a calibration of both cameras. 0 done, 2 bad input. stdout
/// carries the table, or with --json one object and nothing else. `takt calibrate lasers` as add_calibrate_lasers(),
/// `takt calibrate rig` as add_calibrate_rig().
void add_calibrate(CLI::App& app, CalibrateOptions& options, int& exit_code);

/// `takt calibrate lasers`: from sweeps of scanners on a robot that turns to where these are mounted. 0 done, 1 it did
/// not settle, 2 bad input.
void add_calibrate_lasers(CLI::App& calibrate, CalibrateLasersOptions& options, int& exit_code);

/// `takt calibrate rig`: from a rig file of raw pairs to the calibration that fits the simulated camera and its doubles
/// exactly. 0 done, 2 bad input.
void add_calibrate_rig(CLI::App& calibrate, CalibrateRigOptions& options, int& exit_code);

}  // namespace takt::command
