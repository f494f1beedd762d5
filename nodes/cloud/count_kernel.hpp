// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>

#include "nodes/cloud/cell_sort.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {

/// Indices first .. last - 1.
struct Run {
  uint32_t first = 0, last = 0;
  uint32_t size() const { return last - first; }
};

struct Bounds {
  float low[3], high[3];
  size_t points = 0;
};

/// Of the points none of whose coordinates is beyond `farthest_m` or no number.
Bounds bounds_of(std::span<const Point> points, float farthest_m);

/// `points` may be read up to CellSort::kReadAhead past the last query. For each point of `queries`: pass[i] = 1 if at
/// least `needed` points of the runs lie within the radius (itself included, if a run holds it). (dx dx + dy dy) + dz
/// dz <= radius2, each operation rounded to float: every SIMD target decides alike. Counting ends once neighbouring
/// queries all have enough, so the runs that hold most come first.
void decide(const SortedPoint* points, std::span<const Run> runs, Run queries, float radius2, uint32_t needed,
            uint8_t* pass);

/// Name of the SIMD target in use, for reports.
const char* simd_target();

}  // namespace takt::cloud
