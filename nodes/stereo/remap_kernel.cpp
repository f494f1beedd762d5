// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/remap_kernel.hpp"

#include <cstring>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/remap_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {

HWY_INLINE void resample_one(const RemapImage& in, const RemapSource& s, uint8_t* out) {
  const int n = in.channels;
  if (s.x < 0) {
    std::memset(out, 0, static_cast<size_t>(n));
    return;
  }
  const uint8_t* a = in.data + s.y * in.stride + ptrdiff_t{s.x} * n;
  const uint8_t* b = a + in.stride;
  const int fx = s.fraction_x, fy = s.fraction_y;
  for (int c = 0; c < n; ++c) {
    const int top = a[c] * (128 - fx) + a[c + n] * fx, bottom = b[c] * (128 - fx) + b[c + n] * fx;
    out[c] = static_cast<uint8_t>((top * (128 - fy) + bottom * fy + 8192) >> 14);
  }
}

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
/// Two BGR pixels of the upper and two of the lower row in one vector: along x with one multiply-add of bytes, along y
/// with one of words. Reads eight bytes per row where six are meant and writes four where three are.
HWY_INLINE void resample_three(const RemapImage& in, const RemapSource& s, uint8_t* out) {
  const uint8_t* a = in.data + s.y * in.stride + ptrdiff_t{s.x} * 3;
  const __m128i pixels = _mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(a)),
                                            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(a + in.stride)));
  const __m128i pairs = _mm_shuffle_epi8(pixels, _mm_setr_epi8(0, 3, 8, 11, 1, 4, 9, 12, 2, 5, 10, 13, -1, -1, -1, -1));
  const auto weights_x = static_cast<short>(128 + 255 * s.fraction_x);  // bytes 128 - f, f
  const auto weights_y = static_cast<int>(128 + 65535 * s.fraction_y);  // words 128 - f, f
  const __m128i rows = _mm_maddubs_epi16(pairs, _mm_set1_epi16(weights_x));
  const __m128i sums = _mm_madd_epi16(rows, _mm_set1_epi32(weights_y));
  const __m128i rounded = _mm_srli_epi32(_mm_add_epi32(sums, _mm_set1_epi32(8192)), 14);
  const __m128i bytes =
      _mm_shuffle_epi8(rounded, _mm_setr_epi8(0, 4, 8, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1));
  const int word = _mm_cvtsi128_si32(bytes);
  std::memcpy(out, &word, sizeof word);
}
#endif

void remap(const RemapImage& in, const RemapSource* sources, int count, uint8_t* out) {
  int i = 0;
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
  // All but the last pixel of the row may write a byte too many: the next pixel overwrites it. The signed bytes of the
  // weights cannot hold 128, which stands only where a source was clamped at the far edge.
  for (; in.channels == 3 && i + 1 < count; ++i) {
    const RemapSource& s = sources[i];
    const bool wide = s.x >= 0 && (s.x < in.width - 3 || s.y < in.height - 2) && s.fraction_x > 0 && s.fraction_x < 128;
    if (wide) resample_three(in, s, out + 3 * i);
    else resample_one(in, s, out + 3 * i);
  }
#endif
  for (; i < count; ++i) resample_one(in, sources[i], out + in.channels * i);
}

RemapRow target_remap_row() { return remap; }

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_remap_row);
RemapRow remap_row() { return HWY_DYNAMIC_DISPATCH(target_remap_row)(); }
}  // namespace takt::stereo
#endif
