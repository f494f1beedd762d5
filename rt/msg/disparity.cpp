// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/disparity.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(DisparityMap, TAKT_FIELD(DisparityMap, width, "px"), TAKT_FIELD(DisparityMap, height, "px"),
            TAKT_FIELD(DisparityMap, disparities, "px"), TAKT_CAMERA_FIELDS(DisparityMap),
            TAKT_FIELD(DisparityMap, disparity, "px"), TAKT_FIELD(DisparityMap, confidence, "1"),
            TAKT_FIELD(DisparityMap, fraction, "1/64 px"))

}  // namespace takt
