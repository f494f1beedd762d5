// SPDX-License-Identifier: Apache-2.0
// Whole-number arithmetic of the analyses.
#pragma once
#include <cstdint>

namespace takt::analysis {

/// Wide enough for a product of two Ticks; `__extension__` because ISO C++ does not know the type.
__extension__ typedef __int128 Wide;

/// a / b rounded towards minus infinity; b > 0.
constexpr int64_t floor_div(int64_t a, int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }
/// a - b * floor_div(a, b), in [0, b); b > 0.
constexpr int64_t floor_mod(int64_t a, int64_t b) { return a % b + (a % b < 0 ? b : 0); }

}  // namespace takt::analysis
