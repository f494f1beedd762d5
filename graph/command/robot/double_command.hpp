// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

namespace takt::command {

struct DoubleOptions {
  std::string device;
  std::filesystem::path pty;
  std::optional<uint16_t> tcp;
  std::string can;
  std::string video;            ///< device file of v4l2loopback
  std::filesystem::path rig;    ///< of the camera; empty: graph/rigs/xb3.yaml of the project
  double rate_hz = 15;          ///< of the camera
  uint32_t baud = 115200;       ///< of an lms400 on a serial line
  std::filesystem::path world;  ///< empty: graph/worlds/lab.xml of the project
  uint64_t seed = 1;
};

/// `takt double DEVICE`: a stand-in for a device, at the other end of a line that a driver can open. Words on stdin
/// have it misbehave. 0 done, 2 bad input, 3 no line.
void add_double(CLI::App& app, DoubleOptions& options, int& exit_code);

}  // namespace takt::command
