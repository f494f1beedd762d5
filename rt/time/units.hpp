// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/time/units.hpp>: core, stable.
// Nanoseconds in the units of texts and equations.
#pragma once
#include <cstdint>

namespace takt {

constexpr double to_ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }
constexpr double to_seconds(int64_t ns) { return static_cast<double>(ns) * 1e-9; }

}  // namespace takt
