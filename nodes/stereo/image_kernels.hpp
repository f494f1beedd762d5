// SPDX-License-Identifier: Apache-2.0
// Internal: vectorised row operations before and after the matching itself. Every row may be written and read up to
// kRowPadding elements beyond its count.
#pragma once
#include <cstdint>

#include "rt/msg/image_view.hpp"

namespace takt::stereo {

constexpr int kRowPadding = 64;

struct ImageKernels {
  /// BGR to grey (grey_of).
  void (*grey)(const uint8_t* bgr, int count, uint8_t* out);
  /// twice_derivative(before[i], after[i]), as bytes.
  void (*derivative)(const uint8_t* before, const uint8_t* after, int count, uint8_t* out);
  /// Census bits 8 plane .. 8 plane + 7 of a grey row (census_offset): 1 where the neighbour is darker. rows[3] is the
  /// row itself, the others its neighbours above and below; 3 columns beside each are read.
  void (*census)(const uint8_t* const rows[7], int plane, int count, uint8_t* out);
  /// Channel `channel` of interleaved pixels, every byte ^ bias.
  void (*channel)(const uint8_t* pixels, int channels, int channel, int count, uint8_t bias, uint8_t* out);
  void (*reverse)(const uint8_t* in, int count, uint8_t* out);
  /// Every byte four times.
  void (*spread)(const uint8_t* in, int count, uint32_t* out);
  /// out[i] = min of in[i - radius .. i + radius].
  void (*minimum_along)(const uint32_t* in, int radius, int count, uint32_t* out);
  /// out[i] = the smallest rows[k][i] of all `height` rows, one at least.
  void (*minimum_across)(const uint32_t* const* rows, int height, int count, uint32_t* out);
  /// Keys (row_kernel.hpp) to disparities and confidences (confidence_of, max_sum <= 65534).
  void (*decode)(const uint32_t* keys, int max_sum, int min_confidence, int count, int16_t* disparity,
                 uint8_t* confidence);
};

const ImageKernels& image_kernels();

}  // namespace takt::stereo
