// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/requests.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Requests, TAKT_FIELD(Requests, wanted, ""))

}  // namespace takt
