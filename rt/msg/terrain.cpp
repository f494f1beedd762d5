// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/terrain.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Terrain, TAKT_FIELD(Terrain, kind, ""), TAKT_FIELD(Terrain, hypotheses, "1"),
            TAKT_FIELD(Terrain, correlations, "1"))

}  // namespace takt
