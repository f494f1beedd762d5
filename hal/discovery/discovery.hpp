// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace takt::discovery {

/// Something that a driver may fit.
struct Found {
  std::string where;        ///< /dev/video0, can0
  std::string description;  ///< in the words of its kernel driver
  std::string line;         ///< for the devices of a graph's profile; names that survive a replug where there are some
};

/// What is plugged in, from sysfs and the device files below `root`: cameras, CAN interfaces, GPIO chips and serial
/// adapters, each kind in the order of its names. Nothing is opened.
std::vector<Found> discover(const std::filesystem::path& root = "/");

}  // namespace takt::discovery
