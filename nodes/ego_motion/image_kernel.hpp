// SPDX-License-Identifier: Apache-2.0
// Internal: vectorised rows of images. Reads and writes up to Plane::kPadding elements beyond a row's end; every SIMD
// target gives the same bytes.
#pragma once
#include <cstdint>

namespace takt::ego_motion {

struct ImageKernels {
  /// out[x] = rounded mean of a[2 x], a[2 x + 1], b[2 x], b[2 x + 1].
  void (*halve)(const uint8_t* a, const uint8_t* b, int count, uint8_t* out);
  /// sums[x] += added[x] - removed[x], modulo 2^16; `removed` may be null.
  void (*roll)(const uint8_t* added, const uint8_t* removed, int count, uint16_t* sums);
  /// out[x] = (sums[x] + ... + sums[x + 7] + 32) / 64.
  void (*mean_of_8)(const uint16_t* sums, int count, uint8_t* out);
};

const ImageKernels& image_kernels();

}  // namespace takt::ego_motion
