// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/image.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Image, TAKT_FIELD(Image, width, "px"), TAKT_FIELD(Image, height, "px"), TAKT_FIELD(Image, channels, "1"),
            TAKT_FIELD(Image, health, ""), TAKT_CAMERA_FIELDS(Image), TAKT_FIELD(Image, pixels, "1"))
TAKT_FIELDS(StereoPair, TAKT_FIELD(StereoPair, width, "px"), TAKT_FIELD(StereoPair, height, "px"),
            TAKT_FIELD(StereoPair, channels, "1"), TAKT_FIELD(StereoPair, health, ""),
            TAKT_FIELD(StereoPair, frame_number, "1"), TAKT_CAMERA_FIELDS(StereoPair),
            TAKT_TRANSFORM_FIELDS(StereoPair, sensor_in_robot), TAKT_FIELD(StereoPair, left, "1"),
            TAKT_FIELD(StereoPair, right, "1"))

}  // namespace takt
