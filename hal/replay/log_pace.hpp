// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "hal/device.hpp"

namespace takt::replay {

/// How the time of a log becomes the time of a run: the instant `start_ns` of the log is the epoch, and `speed` seconds
/// of the log pass in one second.
struct LogPace {
  double speed = 1.0;    ///< 0.001 .. 1000
  int64_t start_ns = 0;  ///< lines before this are left out

  int64_t stamp_ns(int64_t epoch_ns, int64_t log_ns) const;
  /// A time of the log in the run.
  int64_t in_run_ns(int64_t log_ns) const { return stamp_ns(0, start_ns + log_ns); }
};

/// Refuses a speed out of range, and a start that leaves nothing or makes a run wait for more than 10 s. `what` is
/// wanted of the log ("scan"), `first_ns` the time of the first one at or after the start.
DeviceResult check_pace(const std::string& device_id, const std::filesystem::path& file, const LogPace& pace,
                        const std::string& what, std::optional<int64_t> first_ns);

}  // namespace takt::replay
