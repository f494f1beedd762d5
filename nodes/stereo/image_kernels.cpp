// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/image_kernels.hpp"

#include <algorithm>

#include "nodes/stereo/parameters.hpp"
#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/image_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kBytes;
constexpr hn::ScalableTag<uint16_t> kWords;
constexpr int kByteLanes = static_cast<int>(hn::MaxLanes(kBytes));
using Bytes = hn::Vec<decltype(kBytes)>;
using Words = hn::Vec<decltype(kWords)>;

HWY_INLINE Words weighted(Words b, Words g, Words r) {
  const Words sum = hn::Add(hn::Add(hn::Mul(b, hn::Set(kWords, 29)), hn::Mul(g, hn::Set(kWords, 150))),
                            hn::Add(hn::Mul(r, hn::Set(kWords, 77)), hn::Set(kWords, 128)));
  return hn::ShiftRight<8>(sum);
}

void grey(const uint8_t* bgr, int count, uint8_t* out) {
  const Words low = hn::Set(kWords, 0xFF);
  int i = 0;
  for (; i + kByteLanes <= count; i += kByteLanes) {
    Bytes b, g, r;
    hn::LoadInterleaved3(kBytes, bgr + 3 * i, b, g, r);
    const Words b16 = hn::BitCast(kWords, b), g16 = hn::BitCast(kWords, g), r16 = hn::BitCast(kWords, r);
    const Words even = weighted(hn::And(b16, low), hn::And(g16, low), hn::And(r16, low));
    const Words odd = weighted(hn::ShiftRight<8>(b16), hn::ShiftRight<8>(g16), hn::ShiftRight<8>(r16));
    hn::StoreU(hn::BitCast(kBytes, hn::Or(even, hn::ShiftLeft<8>(odd))), kBytes, out + i);
  }
  for (; i < count; ++i)
    out[i] = static_cast<uint8_t>((29 * bgr[3 * i] + 150 * bgr[3 * i + 1] + 77 * bgr[3 * i + 2] + 128) >> 8);
}

void derivative(const uint8_t* before, const uint8_t* after, int count, uint8_t* out) {
  const Bytes most = hn::Set(kBytes, 127), least = hn::Set(kBytes, 128);
  for (int i = 0; i < count; i += kByteLanes) {
    const Bytes a = hn::LoadU(kBytes, after + i), b = hn::LoadU(kBytes, before + i);
    hn::StoreU(hn::Sub(hn::Min(hn::SaturatedSub(a, b), most), hn::Min(hn::SaturatedSub(b, a), least)), kBytes, out + i);
  }
}

void census(const uint8_t* const rows[7], int plane, int count, uint8_t* out) {
  const uint8_t* neighbours[8];
  for (int i = 0; i < 8; ++i) {
    const CensusOffset o = census_offset(8 * plane + i);
    neighbours[i] = rows[kCensusRadius + o.y] + o.x;
  }
  for (int i = 0; i < count; i += kByteLanes) {
    const Bytes centre = hn::LoadU(kBytes, rows[kCensusRadius] + i);
    Bytes bits = hn::Zero(kBytes);
    for (int bit = 0; bit < 8; ++bit) {
      const auto not_darker =
          hn::Eq(hn::SaturatedSub(centre, hn::LoadU(kBytes, neighbours[bit] + i)), hn::Zero(kBytes));
      bits = hn::Or(bits, hn::IfThenZeroElse(not_darker, hn::Set(kBytes, static_cast<uint8_t>(1u << bit))));
    }
    hn::StoreU(bits, kBytes, out + i);
  }
}

void channel(const uint8_t* pixels, int channels, int channel, int count, uint8_t bias, uint8_t* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<uint8_t>(pixels[i * channels + channel] ^ bias);
}

void reverse(const uint8_t* in, int count, uint8_t* out) {
  for (int i = 0; i < count; ++i) out[i] = in[count - 1 - i];
}

void spread(const uint8_t* in, int count, uint32_t* out) {
  for (int i = 0; i < count; ++i) out[i] = in[i] * 0x01010101u;
}

void minimum_along(const uint32_t* in, int radius, int count, uint32_t* HWY_RESTRICT out) {
  if (radius == 2) {  // the default, in one pass
    for (int i = 0; i < count; ++i) {
      const uint32_t a = in[i - 2] < in[i - 1] ? in[i - 2] : in[i - 1],
                     b = in[i + 2] < in[i + 1] ? in[i + 2] : in[i + 1];
      const uint32_t c = a < b ? a : b;
      out[i] = c < in[i] ? c : in[i];
    }
    return;
  }
  for (int i = 0; i < count; ++i) out[i] = in[i];
  for (int k = 1; k <= radius; ++k)
    for (int i = 0; i < count; ++i) {
      const uint32_t a = in[i - k] < in[i + k] ? in[i - k] : in[i + k];
      out[i] = a < out[i] ? a : out[i];
    }
}

void minimum_across(const uint32_t* const* rows, int height, int count, uint32_t* HWY_RESTRICT out) {
  constexpr hn::ScalableTag<uint32_t> kKeys;
  for (int i = 0; i < count; i += static_cast<int>(hn::MaxLanes(kKeys))) {
    auto smallest = hn::LoadU(kKeys, rows[0] + i);
    for (int k = 1; k < height; ++k) smallest = hn::Min(smallest, hn::LoadU(kKeys, rows[k] + i));
    hn::StoreU(smallest, kKeys, out + i);
  }
}

void decode(const uint32_t* HWY_RESTRICT keys, int max_sum, int min_confidence, int count,
            int16_t* HWY_RESTRICT disparity, uint8_t* HWY_RESTRICT confidence) {
  // confidence_of without an integer division: numerators stay below 2^24, and the quotient of two such floats never
  // rounds up to the next integer (it lies at least 1 / 65534 below, more than half a unit in the last place of 255).
  const auto divisor = static_cast<float>(max_sum);
  const int half = max_sum / 2;  // rounds to the nearest
  for (int i = 0; i < count; ++i) {
    const int sum = static_cast<int>(keys[i] >> 16);
    confidence[i] = static_cast<uint8_t>(static_cast<int>(static_cast<float>(255 * (max_sum - sum) + half) / divisor));
  }
  for (int i = 0; i < count; ++i) {
    const bool reject = (keys[i] & 1) != 0 || confidence[i] < min_confidence;
    disparity[i] = reject ? int16_t{-1} : static_cast<int16_t>((keys[i] & 0xFFFF) >> 7);
  }
}

const ImageKernels& target_image_kernels() {
  static const ImageKernels table{grey,   derivative,    census,         channel, reverse,
                                  spread, minimum_along, minimum_across, decode};
  return table;
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_image_kernels);
const ImageKernels& image_kernels() { return HWY_DYNAMIC_DISPATCH(target_image_kernels)(); }
}  // namespace takt::stereo
#endif
