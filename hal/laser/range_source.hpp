// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <span>

namespace takt {

/// One turn of a double's mirror.
struct Sweep {
  int64_t first_ns = 0;  ///< when the first beam leaves
  double first_angle_rad = 0, step_rad = 0;
  double sweep_s = 0;  ///< from the first to the last beam
};

/// What a double of a laser scanner sees: writes metres, 0 where there is no return.
using RangeSource = std::function<void(const Sweep& sweep, std::span<float> range_m)>;

}  // namespace takt
