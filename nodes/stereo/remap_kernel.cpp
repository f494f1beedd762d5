// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/remap_kernel.hpp"

#include <algorithm>
#include <cstring>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/remap_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {

constexpr int kHalf = 8192;  // of 128 * 128

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kBytes;
constexpr hn::ScalableTag<int8_t> kSigned;
constexpr hn::ScalableTag<int16_t> kWords;
constexpr hn::ScalableTag<int32_t> kSums;
constexpr hn::ScalableTag<uint32_t> kDwords;
using Bytes = hn::Vec<decltype(kBytes)>;
using Words = hn::Vec<decltype(kWords)>;
using Sums = hn::Vec<decltype(kSums)>;
constexpr int kVector = static_cast<int>(hn::MaxLanes(kBytes));
constexpr int kGroup = kVector / 4;  // pixels, a dword each
static_assert(kRemapGroup % kGroup == 0);

/// pair_sums: a[2i] * b[2i] + a[2i + 1] * b[2i + 1] of unsigned and signed bytes; exact, as weights add up to 128.
/// pack: four vectors of dwords to one of bytes, each block of 128 bits for itself.
#if HWY_TARGET == HWY_AVX3
HWY_INLINE Words pair_sums(Bytes a, Bytes b) { return Words{_mm512_maddubs_epi16(a.raw, b.raw)}; }
HWY_INLINE Bytes pack(Sums a, Sums b, Sums c, Sums d) {
  return Bytes{_mm512_packs_epi16(_mm512_packs_epi32(a.raw, b.raw), _mm512_packs_epi32(c.raw, d.raw))};
}
#elif HWY_TARGET == HWY_AVX2
HWY_INLINE Words pair_sums(Bytes a, Bytes b) { return Words{_mm256_maddubs_epi16(a.raw, b.raw)}; }
HWY_INLINE Bytes pack(Sums a, Sums b, Sums c, Sums d) {
  return Bytes{_mm256_packs_epi16(_mm256_packs_epi32(a.raw, b.raw), _mm256_packs_epi32(c.raw, d.raw))};
}
#else
HWY_INLINE Words pair_sums(Bytes a, Bytes b) { return Words{_mm_maddubs_epi16(a.raw, b.raw)}; }
HWY_INLINE Bytes pack(Sums a, Sums b, Sums c, Sums d) {
  return Bytes{_mm_packs_epi16(_mm_packs_epi32(a.raw, b.raw), _mm_packs_epi32(c.raw, d.raw))};
}
#endif

/// The same 16 bytes in each block.
HWY_INLINE Bytes pattern(const uint8_t* bytes) { return hn::LoadDup128(kBytes, bytes); }

/// Of a group, four bytes a pixel: 128 - f and f along x, then along y.
HWY_INLINE Bytes weights_of(const uint16_t* fractions) {
  alignas(16) static constexpr uint8_t kTwice[16] = {0, 0, 1, 1, 4, 4, 5, 5, 8, 8, 9, 9, 12, 12, 13, 13};
  const hn::Rebind<uint16_t, decltype(kDwords)> packed;
  const Bytes f = hn::BitCast(kBytes, hn::PromoteTo(kDwords, hn::LoadU(packed, fractions)));
  const Bytes first = hn::BitCast(kBytes, hn::Set(kDwords, 0x00FF00FFu));
  const Bytes plus = hn::BitCast(kBytes, hn::Set(kDwords, 0x00810081u));  // 255 - f + 129 is 128 - f
  return hn::Add(hn::Xor(hn::TableLookupBytes(f, pattern(kTwice)), first), plus);
}

/// Dwords of the upper and the lower mean along x, weighted: -128..127.
HWY_INLINE Sums mean(Words along_x, Bytes weights_y) {
  Sums odd = hn::Zero(kSums);
  const Sums even =
      hn::ReorderWidenMulAccumulate(kSums, along_x, hn::BitCast(kWords, weights_y), hn::Set(kSums, kHalf), odd);
  return hn::ShiftRight<14>(hn::RearrangeToOddPlusEven(even, odd));
}

/// The four source pixels of one pixel in each block, `step` places apart: colour by colour upper left and right, lower
/// left and right.
HWY_INLINE Bytes sources(const RemapRow& row, int first) {
  const hn::FixedTag<int8_t, 8> two;
  const auto block = [&](int i) HWY_ATTR {
    const int8_t* upper = row.window + 4 * size_t{row.offsets[first + 4 * i]};
    return hn::Combine(hn::FixedTag<int8_t, 16>(), hn::LoadU(two, upper + row.stride), hn::LoadU(two, upper));
  };
#if HWY_TARGET == HWY_AVX3
  const hn::FixedTag<int8_t, 32> half;
  const auto v = hn::Combine(kSigned, hn::Combine(half, block(3), block(2)), hn::Combine(half, block(1), block(0)));
#elif HWY_TARGET == HWY_AVX2
  const auto v = hn::Combine(kSigned, block(1), block(0));
#else
  const auto v = block(0);
#endif
  alignas(16) static constexpr uint8_t kByColour[16] = {0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15};
  return hn::TableLookupBytes(hn::BitCast(kBytes, v), pattern(kByColour));
}

/// Pixel kPixel of each block of a group.
template <int kPixel>
HWY_INLINE Sums resample(const RemapRow& row, int first, Bytes weights) {
  constexpr uint8_t x = 4 * kPixel, y = x + 2, no = 0x80;
  alignas(16) static constexpr uint8_t kAlongX[16] = {x, x + 1, x, x + 1, x, x + 1, x, x + 1,
                                                      x, x + 1, x, x + 1, x, x + 1, x, x + 1};
  alignas(16) static constexpr uint8_t kAlongY[16] = {y, no, y + 1, no, y, no, y + 1, no,
                                                      y, no, y + 1, no, y, no, y + 1, no};
  return mean(pair_sums(hn::TableLookupBytes(weights, pattern(kAlongX)), sources(row, first + kPixel)),
              hn::TableLookupBytesOr0(weights, pattern(kAlongY)));
}

/// Four bytes a pixel to three, at the front of the vector.
HWY_INLINE Bytes without_fourth(Bytes pixels) {
  alignas(16) static constexpr uint8_t kThree[16] = {0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0x80, 0x80, 0x80, 0x80};
  const auto blocks = hn::BitCast(kDwords, hn::TableLookupBytesOr0(pixels, pattern(kThree)));
  alignas(64) static constexpr int32_t kTogether[16] = {0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 3, 7, 11, 15};
  alignas(64) static constexpr int32_t kTwoTogether[8] = {0, 1, 2, 4, 5, 6, 3, 7};
  if constexpr (kVector == 16) return hn::BitCast(kBytes, blocks);
  const auto order = hn::SetTableIndices(kDwords, kVector == 64 ? kTogether : kTwoTogether);
  return hn::BitCast(kBytes, hn::TableLookupLanes(blocks, order));
}

void bgr(const RemapRow& row, uint8_t* out) {
  const Bytes bias = hn::Set(kBytes, 128);
  for (int i = 0; i < row.count; i += kGroup) {
    const Bytes weights = weights_of(row.fractions + i);
    const Bytes pixels = pack(resample<0>(row, i, weights), resample<1>(row, i, weights), resample<2>(row, i, weights),
                              resample<3>(row, i, weights));
    const Bytes three = without_fourth(hn::Xor(pixels, bias));
    uint8_t* to = out + 3 * ptrdiff_t{i};
    const int left = 3 * (row.count - i);
    if (left >= kVector) {  // a quarter of it is overwritten by the next group
      hn::StoreU(three, kBytes, to);
    } else {
      alignas(64) uint8_t last[kVector];
      hn::Store(three, kBytes, last);
      std::memcpy(to, last, static_cast<size_t>(std::min(left, 3 * kGroup)));
    }
  }
}

void grey(const RemapRow& row, uint8_t* out) {
  alignas(16) static constexpr uint8_t kAlongX[16] = {0, 1, 0, 1, 4, 5, 4, 5, 8, 9, 8, 9, 12, 13, 12, 13};
  alignas(16) static constexpr uint8_t kAlongY[16] = {2,  0x80, 3,  0x80, 6,  0x80, 7,  0x80,
                                                      10, 0x80, 11, 0x80, 14, 0x80, 15, 0x80};
  const hn::Rebind<int8_t, decltype(kSums)> narrow;
  // Many at a time: a vector must not wait for the narrow stores that it is loaded from.
  constexpr int kChunk = 4 * kRemapGroup;
  alignas(64) int8_t sources[4 * kChunk] = {};  // of each pixel: upper left and right, lower left and right
  for (int begin = 0; begin < row.count; begin += kChunk) {
    const int end = std::min(begin + kChunk, row.count);
    for (int i = begin; i < end; ++i) {
      const int8_t* upper = row.window + row.offsets[i];
      std::memcpy(sources + 4 * (i - begin), upper, 2);
      std::memcpy(sources + 4 * (i - begin) + 2, upper + row.stride, 2);
    }
    for (int i = begin; i < end; i += kGroup) {
      const Bytes weights = weights_of(row.fractions + i);
      const Words along_x = pair_sums(hn::TableLookupBytes(weights, pattern(kAlongX)),
                                      hn::BitCast(kBytes, hn::Load(kSigned, sources + 4 * (i - begin))));
      const auto values = hn::DemoteTo(narrow, mean(along_x, hn::TableLookupBytesOr0(weights, pattern(kAlongY))));
      alignas(64) int8_t made[kGroup];
      hn::StoreU(hn::Xor(values, hn::Set(narrow, -128)), narrow, made);
      std::memcpy(out + i, made, static_cast<size_t>(std::min(kGroup, end - i)));
    }
  }
}

#else

template <int kStep, int kChannels>
void remap(const RemapRow& row, uint8_t* out) {
  for (int i = 0; i < row.count; ++i) {
    const int8_t* a = row.window + kStep * size_t{row.offsets[i]};
    const int8_t* b = a + row.stride;
    const int fx = row.fractions[i] & 0xFF, fy = row.fractions[i] >> 8;
    for (int c = 0; c < kChannels; ++c) {
      const int top = a[c] * (128 - fx) + a[c + kStep] * fx, bottom = b[c] * (128 - fx) + b[c + kStep] * fx;
      out[kChannels * i + c] = static_cast<uint8_t>(((top * (128 - fy) + bottom * fy + kHalf) >> 14) + 128);
    }
  }
}
void bgr(const RemapRow& row, uint8_t* out) { remap<4, 3>(row, out); }
void grey(const RemapRow& row, uint8_t* out) { remap<1, 1>(row, out); }

#endif

const RemapKernels& target_remap_kernels() {
  static const RemapKernels table{bgr, grey};
  return table;
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_remap_kernels);
const RemapKernels& remap_kernels() { return HWY_DYNAMIC_DISPATCH(target_remap_kernels)(); }
}  // namespace takt::stereo
#endif
