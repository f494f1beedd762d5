// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/detections.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Detections, TAKT_FIELD(Detections, image_width, "px"), TAKT_FIELD(Detections, image_height, "px"),
            TAKT_FIELD(Detections, searched, "1"), TAKT_FIELD(Detections, boxes, "px"))

}  // namespace takt
