// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/action.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(ActionCommand, TAKT_FIELD(ActionCommand, number, "1"), TAKT_FIELD(ActionCommand, action, ""),
            TAKT_FIELD(ActionCommand, objects, ""))
TAKT_FIELDS(ActionOutcome, TAKT_FIELD(ActionOutcome, number, "1"), TAKT_FIELD(ActionOutcome, state, ""),
            TAKT_FIELD(ActionOutcome, duration_s, "s"), TAKT_FIELD(ActionOutcome, reason, ""))

}  // namespace takt
