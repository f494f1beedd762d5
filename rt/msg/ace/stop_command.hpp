// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/stop_command.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

/// Why a stop is commanded (bits of StopCommand::reasons); 0: drive on.
namespace stop_reason {
constexpr uint32_t obstacle = 1, line = 2, scan_lost = 4, line_lost = 8, safe_stop = 16;
}

/// Stop or drive on, decided from lasers, lines and the mode alone; repeated every job, so that silence means stop.
struct StopCommand {
  static constexpr std::string_view type_name = "stop_command";
  uint32_t reasons = 0;   ///< bits of takt::stop_reason; 0: drive on
  double nearest_m = 0;   ///< of the returns in the protected area; 0: none
  double scan_age_s = 0;  ///< of the oldest scan used, at the job's release
  bool stop() const { return reasons != 0; }
  TAKT_FIELDS(StopCommand, (reasons, ""), (nearest_m, "m"), (scan_age_s, "s"))
};

}  // namespace takt
