// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/point_cloud.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(PointCloud, TAKT_TRANSFORM_FIELDS(PointCloud, sensor_in_robot), TAKT_CAMERA_FIELDS(PointCloud),
            TAKT_FIELD(PointCloud, step_px, "px"), TAKT_FIELD(PointCloud, points, "m"),
            TAKT_FIELD(PointCloud, colours, "1"))

}  // namespace takt
