// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/pose.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Pose, TAKT_TRANSFORM_FIELDS(Pose, transform), TAKT_FIELD(Pose, covariance, ""))

}  // namespace takt
