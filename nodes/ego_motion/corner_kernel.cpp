// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/corner_kernel.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ego_motion/corner_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ego_motion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::Rebind<int16_t, decltype(kFloats)> kShorts;  // as many as there are floats
constexpr hn::ScalableTag<int16_t> kWords;
constexpr hn::Rebind<uint8_t, decltype(kWords)> kBytes;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kFloats));
constexpr int kWordLanes = static_cast<int>(hn::MaxLanes(kWords));
using Floats = hn::Vec<decltype(kFloats)>;
using Words = hn::Vec<decltype(kWords)>;

HWY_INLINE Words words(const uint8_t* bytes) { return hn::PromoteTo(kWords, hn::LoadU(kBytes, bytes)); }
HWY_INLINE Floats floats(const int16_t* words) {
  const hn::Rebind<int32_t, decltype(kFloats)> whole;
  return hn::ConvertTo(kFloats, hn::PromoteTo(whole, hn::LoadU(kShorts, words)));
}

// Separable Sobel: smoothed down the column for gx, differenced for gy; 16 bits hold both.
void gradients(const uint8_t* above, const uint8_t* row, const uint8_t* below, int width, int16_t* HWY_RESTRICT smooth,
               int16_t* HWY_RESTRICT step, const GradientRow& out) {
  for (int x = 0; x < width; x += kWordLanes) {
    const Words a = words(above + x), b = words(row + x), c = words(below + x);
    hn::StoreU(hn::Add(hn::Add(a, c), hn::Add(b, b)), kWords, smooth + x);
    hn::StoreU(hn::Sub(c, a), kWords, step + x);
  }
  HWY_ALIGN int16_t gx[kWordLanes], gy[kWordLanes];
  for (int x = 1; x < width - 1; x += kWordLanes) {
    const Words s = hn::LoadU(kWords, step + x);
    hn::Store(hn::Sub(hn::LoadU(kWords, smooth + x + 1), hn::LoadU(kWords, smooth + x - 1)), kWords, gx);
    hn::Store(hn::Add(hn::Add(hn::LoadU(kWords, step + x - 1), hn::LoadU(kWords, step + x + 1)), hn::Add(s, s)), kWords,
              gy);
    for (int i = 0; i < kWordLanes; i += kLanes) {
      const Floats fx = floats(gx + i), fy = floats(gy + i);
      hn::StoreU(hn::Mul(fx, fx), kFloats, out.xx + x + i);
      hn::StoreU(hn::Mul(fx, fy), kFloats, out.xy + x + i);
      hn::StoreU(hn::Mul(fy, fy), kFloats, out.yy + x + i);
    }
  }
}

/// Of three neighbours in a row.
HWY_INLINE Floats sum_of_3(const float* middle) {
  return hn::Add(hn::Add(hn::LoadU(kFloats, middle - 1), hn::LoadU(kFloats, middle)), hn::LoadU(kFloats, middle + 1));
}

// Sums of squares of Sobel values stay below 2^24, so float sums are exact and their order does not matter.
float response(const GradientRow* rows, int width, const GradientRow& sums, float largest, float* HWY_RESTRICT out) {
  const auto add_rows = [&](float* GradientRow::*product) HWY_ATTR {
    float* HWY_RESTRICT sum = sums.*product;
    for (int x = 1; x < width - 1; x += kLanes)
      hn::StoreU(hn::Add(hn::Add(hn::LoadU(kFloats, rows[0].*product + x), hn::LoadU(kFloats, rows[1].*product + x)),
                         hn::LoadU(kFloats, rows[2].*product + x)),
                 kFloats, sum + x);
  };
  add_rows(&GradientRow::xx);
  add_rows(&GradientRow::xy);
  add_rows(&GradientRow::yy);
  const Floats half = hn::Set(kFloats, 0.5f);
  Floats most = hn::Set(kFloats, largest);
  for (int x = 2; x < width - 2; x += kLanes) {
    const Floats xx = sum_of_3(sums.xx + x), xy = sum_of_3(sums.xy + x), yy = sum_of_3(sums.yy + x);
    const Floats half_difference = hn::Mul(half, hn::Sub(xx, yy));
    const Floats root = hn::Sqrt(hn::Add(hn::Mul(half_difference, half_difference), hn::Mul(xy, xy)));
    const Floats smaller = hn::Sub(hn::Mul(half, hn::Add(xx, yy)), root);
    const auto inside = hn::FirstN(kFloats, static_cast<size_t>(width - 2 - x));
    const Floats r = hn::IfThenElseZero(inside, smaller);
    hn::StoreU(r, kFloats, out + x);
    most = hn::Max(most, r);
  }
  return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

int peaks(const float* above, const float* row, const float* below, float threshold, int first, int last,
          int32_t* out) {
  const Floats least = hn::Set(kFloats, threshold);
  const auto around = [](const float* middle) HWY_ATTR {
    return hn::Max(hn::Max(hn::LoadU(kFloats, middle - 1), hn::LoadU(kFloats, middle)), hn::LoadU(kFloats, middle + 1));
  };
  int count = 0;
  for (int x = first; x < last; x += kLanes) {
    const Floats r = hn::LoadU(kFloats, row + x);
    const Floats most = hn::Max(hn::Max(around(above + x), around(below + x)), hn::Max(around(row + x), least));
    const auto found = hn::And(hn::Ge(r, most), hn::FirstN(kFloats, static_cast<size_t>(last - x)));
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(kFloats, found, bytes);
    for (unsigned bits = bytes[0] | unsigned{bytes[1]} << 8; bits != 0; bits &= bits - 1)
      out[count++] = x + static_cast<int32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
  }
  return count;
}

const CornerKernels& target_corner_kernels() {
  static const CornerKernels table{gradients, response, peaks};
  return table;
}

}  // namespace takt::ego_motion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ego_motion {
HWY_EXPORT(target_corner_kernels);
const CornerKernels& corner_kernels() { return HWY_DYNAMIC_DISPATCH(target_corner_kernels)(); }
}  // namespace takt::ego_motion
#endif
