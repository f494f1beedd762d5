// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/text_status.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(TextStatus, TAKT_FIELD(TextStatus, text, ""))

}  // namespace takt
