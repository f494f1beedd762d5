// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/image_kernel.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ego_motion/image_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ego_motion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint16_t> kWords;
constexpr hn::Rebind<uint8_t, decltype(kWords)> kHalfBytes;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kWords));
using Words = hn::Vec<decltype(kWords)>;

/// Words of at most 255 to bytes.
HWY_INLINE void store_bytes(Words v, uint8_t* out) {
  const hn::RebindToSigned<decltype(kWords)> signed_words;
  hn::StoreU(hn::DemoteTo(kHalfBytes, hn::BitCast(signed_words, v)), kHalfBytes, out);
}

void halve(const uint8_t* a, const uint8_t* b, int count, uint8_t* out) {
  const hn::Repartition<uint8_t, decltype(kWords)> bytes;
  const Words low = hn::Set(kWords, 0xFF), two = hn::Set(kWords, 2);
  const auto pairs = [&](const uint8_t* row) HWY_ATTR {
    const Words v = hn::BitCast(kWords, hn::LoadU(bytes, row));
    return hn::Add(hn::And(v, low), hn::ShiftRight<8>(v));
  };
  for (int x = 0; x < count; x += kLanes)
    store_bytes(hn::ShiftRight<2>(hn::Add(hn::Add(pairs(a + 2 * x), pairs(b + 2 * x)), two)), out + x);
}

void roll(const uint8_t* added, const uint8_t* removed, int count, uint16_t* sums) {
  for (int x = 0; x < count; x += kLanes) {
    Words sum = hn::Add(hn::LoadU(kWords, sums + x), hn::PromoteTo(kWords, hn::LoadU(kHalfBytes, added + x)));
    if (removed) sum = hn::Sub(sum, hn::PromoteTo(kWords, hn::LoadU(kHalfBytes, removed + x)));
    hn::StoreU(sum, kWords, sums + x);
  }
}

void mean_of_8(const uint16_t* sums, int count, uint8_t* out) {
  for (int x = 0; x < count; x += kLanes) {
    Words sum = hn::Set(kWords, 32);
    for (int k = 0; k < 8; ++k) sum = hn::Add(sum, hn::LoadU(kWords, sums + x + k));
    store_bytes(hn::ShiftRight<6>(sum), out + x);
  }
}

const ImageKernels& target_image_kernels() {
  static const ImageKernels table{halve, roll, mean_of_8};
  return table;
}

}  // namespace takt::ego_motion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ego_motion {
HWY_EXPORT(target_image_kernels);
const ImageKernels& image_kernels() { return HWY_DYNAMIC_DISPATCH(target_image_kernels)(); }
}  // namespace takt::ego_motion
#endif
