// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/grid.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Grid, TAKT_FIELD(Grid, width, "1"), TAKT_FIELD(Grid, height, "1"), TAKT_FIELD(Grid, cell_m, "m"),
            TAKT_FIELD(Grid, origin_x_m, "m"), TAKT_FIELD(Grid, origin_y_m, "m"),
            TAKT_TRANSFORM_FIELDS(Grid, grid_in_map), TAKT_FIELD(Grid, cells, "1"))

}  // namespace takt
