// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/motion.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Motion, TAKT_FIELD(Motion, from_stamp_ns, "ns"), TAKT_TRANSFORM_FIELDS(Motion, camera_in_previous),
            TAKT_TRANSFORM_FIELDS(Motion, pose), TAKT_FIELD(Motion, confidence, "1"), TAKT_FIELD(Motion, rms_px, "px"),
            TAKT_FIELD(Motion, corners, "1"), TAKT_FIELD(Motion, matched, "1"), TAKT_FIELD(Motion, inliers, "1"),
            TAKT_FIELD(Motion, valid, ""), TAKT_FIELD(Motion, keyframe, ""))

}  // namespace takt
