// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace takt::command {

struct CaptureOptions {
  std::string device;  ///< a CAN interface, unix:PATH of a double, a serial line, or numbers and port of a connection
  std::filesystem::path file;
  double duration_s = 10;    ///< or until SIGINT
  std::string scanner = {};  ///< lms200, lms400: is asked for scans meanwhile; empty: it is only listened
  uint32_t baud = 38400;     ///< of a serial line
};

/// `takt capture DEVICE FILE`: what a device says, for a bug report or a new golden vector. Of a CAN bus every frame,
/// one a line, as `candump -L` writes and `canplayer` reads them, error frames too; of any other line its bytes as they
/// came. 0 done, 2 bad input, 3 the device cannot be had or goes.
int capture_device(const CaptureOptions& options);

}  // namespace takt::command
