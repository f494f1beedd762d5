// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/stop_command.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(StopCommand, TAKT_FIELD(StopCommand, reasons, ""), TAKT_FIELD(StopCommand, nearest_m, "m"),
            TAKT_FIELD(StopCommand, scan_age_s, "s"))

}  // namespace takt
