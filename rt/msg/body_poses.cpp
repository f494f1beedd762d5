// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/body_poses.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(BodyPoses, TAKT_FIELD(BodyPoses, joints, "1"), TAKT_FIELD(BodyPoses, candidates, "1"),
            TAKT_FIELD(BodyPoses, searched, "1"), TAKT_FIELD(BodyPoses, bodies, ""))

}  // namespace takt
