// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace takt::command {

/// `takt devices`: what is plugged in, which driver fits, and a line for the graph file. 0, also when there is nothing.
/// stdout carries the table, or with `json` one array and nothing else. `root`: where sysfs is looked for.
int list_devices(bool json, const std::filesystem::path& root = "/");

struct CaptureOptions {
  std::string device;  ///< a CAN interface, or unix:PATH of a double
  std::filesystem::path file;
  double duration_s = 10;  ///< or until SIGINT
};

/// `takt capture DEVICE FILE`: every frame of a CAN bus as it comes, one a line, as `candump -L` writes and `canplayer`
/// reads them, error frames too. 0 done, 2 bad input, 3 the device cannot be had or goes.
int capture_device(const CaptureOptions& options);

}  // namespace takt::command
