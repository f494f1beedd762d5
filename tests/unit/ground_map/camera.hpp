// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/msg/geometry.hpp"

namespace takt::test {

/// The camera that looks at the floor.
inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr CameraModel kCamera{141.5, 159.5, 119.5, 0.12};

}  // namespace takt::test
