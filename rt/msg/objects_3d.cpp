// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/objects_3d.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Objects3d, TAKT_FIELD(Objects3d, searched, "1"), TAKT_FIELD(Objects3d, supported, ""),
            TAKT_FIELD(Objects3d, support_a, "1"), TAKT_FIELD(Objects3d, support_b, "1"),
            TAKT_FIELD(Objects3d, support_m, "m"), TAKT_FIELD(Objects3d, objects, ""))

}  // namespace takt
