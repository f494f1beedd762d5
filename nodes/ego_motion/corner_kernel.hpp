// SPDX-License-Identifier: Apache-2.0
// Internal: vectorised rows of the corner detector. Reads and writes up to kRowPadding elements beyond a row's end;
// every SIMD target gives the same bits.
#pragma once
#include <cstdint>

namespace takt::ego_motion {

constexpr int kRowPadding = 64;

/// Products of the gradients of one image row.
struct GradientRow {
  float *xx, *xy, *yy;
};

struct CornerKernels {
  /// Products of the 3 x 3 Sobel gradients of the middle one of three image rows, for x in 1 .. width - 2. `smooth` and
  /// `step` are scratch.
  void (*gradients)(const uint8_t* above, const uint8_t* row, const uint8_t* below, int width, int16_t* smooth,
                    int16_t* step, const GradientRow& out);
  /// Smaller eigenvalues of the gradient matrices summed over three rows and columns, for x in 2 .. width - 3; returns
  /// the larger of `largest` and the largest of them. `sums` is scratch.
  float (*response)(const GradientRow* three_rows, int width, const GradientRow& sums, float largest, float* out);
  /// Writes those x of first .. last - 1 where `row` is at least `threshold` and at least its eight neighbours; returns
  /// how many.
  int (*peaks)(const float* above, const float* row, const float* below, float threshold, int first, int last,
               int32_t* out);
};

const CornerKernels& corner_kernels();

}  // namespace takt::ego_motion
