// SPDX-License-Identifier: Apache-2.0
// Internal: sums over the pixels of a patch. One accumulator per column, added up in a fixed order, so that every SIMD
// target gives the same bits.
#pragma once
#include <cmath>

#include "nodes/ego_motion/refine.hpp"

namespace takt::ego_motion {

/// Pixel to the upper left of a position in an image, and the fractions to it.
struct BilinearOrigin {
  const uint8_t* pixel;
  ptrdiff_t stride;
  float fx, fy;
};

/// Of the sample that lies (column, row) from (x, y).
inline BilinearOrigin origin(const Plane& image, double x, double y, int column, int row) {
  const double left = std::floor(x), top = std::floor(y);
  return {image.row(static_cast<int>(top) + row) + static_cast<int>(left) + column, image.stride(),
          static_cast<float>(x - left), static_cast<float>(y - top)};
}

/// Adds up the columns' accumulators pairwise: 8 apart, 4, 2, 1.
inline float sum_of_columns(const float (&columns)[RefinePatch::kRow]) {
  float eight[8], four[4];
  for (int i = 0; i < 8; ++i) eight[i] = columns[i] + columns[i + 8];
  for (int i = 0; i < 4; ++i) four[i] = eight[i] + eight[i + 4];
  return (four[0] + four[2]) + (four[1] + four[3]);
}

struct RefineKernels {
  /// Fills all but `half`; `at` is the origin of the sample (-half - 1, -half - 1), the patch's gradient lies inside.
  void (*take)(const BilinearOrigin& at, RefinePatch::Samples& out);
  /// Sums of gx and gy times the image; `at` is the origin of the sample (-half, -half). (The patch itself adds
  /// nothing: the gradients are orthogonal to it.)
  void (*sums)(const RefinePatch::Samples& patch, const BilinearOrigin& at, float& x, float& y);
  /// That of gx alone, and that of value.
  float (*sum_x)(const RefinePatch::Samples& patch, const BilinearOrigin& at);
  float (*sum_value)(const RefinePatch::Samples& patch, const BilinearOrigin& at);
};

}  // namespace takt::ego_motion
