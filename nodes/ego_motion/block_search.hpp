// SPDX-License-Identifier: Apache-2.0
// Block matching by the sum of absolute differences (thesis Eq. 4.9 - 4.11 with one joint minimum, erratum E-22).
#pragma once
#include <cstdint>
#include <cstdlib>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "nodes/ego_motion/plane.hpp"

namespace takt::ego_motion {

/// A square of grey values, (2 half + 1)^2 pixels with half <= 7, laid out for vector loads.
struct Patch {
  static constexpr int kMaximumHalf = 7;
  alignas(16) uint8_t values[15][16];
  alignas(16) uint8_t mask[16];
  int half = 0;

  /// Copies the square centred on (x, y), which must lie inside the image.
  void take(const Plane& image, int x, int y, int half_size) {
    half = half_size;
    for (int i = 0; i < 16; ++i) mask[i] = i <= 2 * half ? 0xFF : 0;
    for (int v = 0; v <= 2 * half; ++v) {
      const uint8_t* from = image.row(y - half + v) + x - half;
      for (int i = 0; i < 16; ++i) values[v][i] = static_cast<uint8_t>(i <= 2 * half ? from[i] : 0);
    }
  }
};

/// Sum of |patch - image| with the patch centred on (x, y); the square must lie inside the image.
inline uint32_t sad(const Patch& patch, const Plane& image, int x, int y) {
  const uint8_t* at = image.row(y - patch.half) + x - patch.half;
#if defined(__SSE2__)
  const __m128i mask = _mm_load_si128(reinterpret_cast<const __m128i*>(patch.mask));
  __m128i sum = _mm_setzero_si128();
  for (int v = 0; v <= 2 * patch.half; ++v, at += image.stride()) {
    const __m128i there = _mm_and_si128(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)), mask);
    sum = _mm_add_epi32(sum, _mm_sad_epu8(there, _mm_load_si128(reinterpret_cast<const __m128i*>(patch.values[v]))));
  }
  return static_cast<uint32_t>(_mm_cvtsi128_si32(sum) + _mm_cvtsi128_si32(_mm_srli_si128(sum, 8)));
#else
  uint32_t sum = 0;
  for (int v = 0; v <= 2 * patch.half; ++v, at += image.stride())
    for (int i = 0; i <= 2 * patch.half; ++i) sum += static_cast<uint32_t>(std::abs(patch.values[v][i] - at[i]));
  return sum;
#endif
}

/// Where a patch fits best.
struct BlockMatch {
  int x = 0, y = 0;
  uint32_t cost = UINT32_MAX;  ///< UINT32_MAX: no admissible position
  bool found() const { return cost != UINT32_MAX; }
};

/// Joint minimum over all positions within +-radius_x, +-radius_y of (x, y) whose square lies inside the image; of
/// equal costs the first in row order. `candidates`, if given, is a map of the image's size: positions with 0 are
/// skipped.
inline BlockMatch block_search(const Patch& patch, const Plane& image, int x, int y, int radius_x, int radius_y,
                               const uint8_t* candidates = nullptr) {
  const int left = std::max(patch.half, x - radius_x), right = std::min(image.width() - 1 - patch.half, x + radius_x);
  const int top = std::max(patch.half, y - radius_y), bottom = std::min(image.height() - 1 - patch.half, y + radius_y);
  BlockMatch best;
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      if (candidates && !candidates[static_cast<ptrdiff_t>(v) * image.width() + u]) continue;
      const uint32_t cost = sad(patch, image, u, v);
      if (cost < best.cost) best = {u, v, cost};
    }
  return best;
}

/// The slow, obvious block_search: three nested loops over single pixels.
BlockMatch block_search_reference(const Plane& previous, int from_x, int from_y, int half, const Plane& image, int x,
                                  int y, int radius_x, int radius_y);

/// Minimum of the parabola through three equidistant costs, in -0.5..0.5 steps; 0 where it has none.
inline double parabola_offset(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  if (curvature <= 0) return 0;
  const double offset = 0.5 * (before - after) / curvature;
  return offset < -0.5 ? -0.5 : offset > 0.5 ? 0.5 : offset;
}

}  // namespace takt::ego_motion
