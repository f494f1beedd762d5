// SPDX-License-Identifier: Apache-2.0
// Block matching by the sum of absolute differences (thesis Eq. 4.9 - 4.11 with one joint minimum, erratum E-22). Where
// the levels hold means, a block is first made as bright as what it is compared with: a change of exposure costs
// nothing.
#pragma once
#include <cstdint>
#include <cstdlib>

#include "nodes/ego_motion/plane.hpp"

namespace takt::ego_motion {

/// A square of grey values, (2 half + 1)^2 pixels with half <= 7, laid out for vectors: a row has 16 bytes, one of at
/// most 7 pixels stands in both halves; unused bytes are 0.
struct Patch {
  static constexpr int kMaximumHalf = 7;
  static constexpr int kNarrowHalf = 3;  ///< rows up to this one stand twice
  alignas(16) uint8_t values[2 * kMaximumHalf + 1][16];
  uint8_t mean = 0;
  int half = 0;

  /// Copies the square centred on (x, y), which must lie inside the image.
  void take(const Level& level, int x, int y, int half_size);
};

/// Sum of |patch - image| with the patch centred on (x, y), brightened by the difference of the means there and clamped
/// to 0..255; the square must lie inside the image.
uint32_t sad(const Patch& patch, const Level& level, int x, int y);

/// Where a patch fits best.
struct BlockMatch {
  int x = 0, y = 0;
  uint32_t cost = UINT32_MAX;  ///< UINT32_MAX: no admissible position
  bool found() const { return cost != UINT32_MAX; }
};

/// Joint minimum over all positions within +-radius_x, +-radius_y of (x, y) whose square lies inside the image; of
/// equal costs the first in row order.
BlockMatch block_search(const Patch& patch, const Level& level, int x, int y, int radius_x, int radius_y);

/// The same over those positions only where `candidates`, a map of the image's size, is not 0.
BlockMatch block_search_among(const Patch& patch, const Level& level, int x, int y, int radius_x, int radius_y,
                              const uint8_t* candidates);

/// The slow, obvious block_search: three nested loops over single pixels.
BlockMatch block_search_reference(const Level& previous, int from_x, int from_y, int half, const Level& level, int x,
                                  int y, int radius_x, int radius_y);

/// Minimum of the parabola through three equidistant costs, in -0.5..0.5 steps; 0 where it has none.
inline double parabola_offset(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  if (curvature <= 0) return 0;
  const double offset = 0.5 * (before - after) / curvature;
  return offset < -0.5 ? -0.5 : offset > 0.5 ? 0.5 : offset;
}

}  // namespace takt::ego_motion
