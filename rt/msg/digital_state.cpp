// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/digital_state.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(DigitalState, TAKT_FIELD(DigitalState, levels, ""), TAKT_FIELD(DigitalState, changed, ""))

}  // namespace takt
