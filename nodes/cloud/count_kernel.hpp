// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>

namespace takt::cloud {

/// Indices first .. last - 1.
struct Run {
  uint32_t first = 0, last = 0;
  uint32_t size() const { return last - first; }
};

/// Coordinates of sorted points; 64 floats past the last may be read.
struct Coordinates {
  const float *x, *y, *z;
};

/// For each point of `queries`: pass[i] = 1 if at least `needed` points of the runs lie within the radius (itself
/// included, if a run holds it). (dx dx + dy dy) + dz dz <= radius2, each operation rounded to float: every SIMD target
/// decides alike. Stops counting at `needed`.
void decide(const Coordinates& points, std::span<const Run> runs, Run queries, float radius2, uint32_t needed,
            uint8_t* pass);

/// Name of the SIMD target in use, for reports.
const char* simd_target();

}  // namespace takt::cloud
