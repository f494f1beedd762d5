// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/log_pace.hpp"

#include <cmath>

namespace takt::replay {

int64_t LogPace::stamp_ns(int64_t epoch_ns, int64_t log_ns) const {
  const int64_t since = log_ns - start_ns;
  // Nanoseconds stay exact at the recorded speed, however long the log is.
  return epoch_ns + (speed == 1.0 ? since : std::llround(static_cast<double>(since) / speed));
}

DeviceResult check_pace(const std::string& id, const std::filesystem::path& file, const LogPace& pace,
                        const std::string& what, std::optional<int64_t> first_ns) {
  constexpr double kPatience_s = 10.0;
  if (!(pace.speed >= 0.001 && pace.speed <= 1000.0))
    return device_error(id, "`speed` is " + std::to_string(pace.speed), "use 0.001 to 1000; 1 is as recorded");
  const double start_s = static_cast<double>(pace.start_ns) * 1e-9;
  if (!first_ns)
    return device_error(id, file.string() + ": no " + what + " at or after " + std::to_string(start_s) + " s",
                        "choose another log, or an earlier `start`");
  const double wait_s = static_cast<double>(*first_ns - pace.start_ns) * 1e-9;
  if (wait_s / pace.speed > kPatience_s)
    return device_error(
        id, file.string() + ": the first " + what + " comes " + std::to_string(wait_s) + " s of the log after `start`",
        "add `start: " + std::to_string(start_s + wait_s) + "s` (the same for all devices of the log)");
  return {};
}

}  // namespace takt::replay
