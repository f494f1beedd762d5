// SPDX-License-Identifier: Apache-2.0
// Internal: Hamming distance of census bits, for the kernels of each SIMD target.
#if defined(TAKT_STEREO_COUNT_ONES) == defined(HWY_TARGET_TOGGLE)
#ifdef TAKT_STEREO_COUNT_ONES
#undef TAKT_STEREO_COUNT_ONES
#else
#define TAKT_STEREO_COUNT_ONES
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kByteTag;
constexpr hn::ScalableTag<uint16_t> kWordTag;
using Vec8 = hn::Vec<decltype(kByteTag)>;

/// Number of ones in each byte, times `weight`.
template <int kWeight>
HWY_INLINE Vec8 weighted_ones(Vec8 v) {
  HWY_ALIGN static constexpr uint8_t kOnes[16] = {
      0,       kWeight,     kWeight,     2 * kWeight, kWeight,     2 * kWeight, 2 * kWeight, 3 * kWeight,
      kWeight, 2 * kWeight, 2 * kWeight, 3 * kWeight, 2 * kWeight, 3 * kWeight, 3 * kWeight, 4 * kWeight};
  const Vec8 table = hn::LoadDup128(kByteTag, kOnes), low = hn::Set(kByteTag, 0xF);
  const Vec8 high = hn::And(hn::BitCast(kByteTag, hn::ShiftRight<4>(hn::BitCast(kWordTag, v))), low);
  return hn::Add(hn::TableLookupBytes(table, hn::And(v, low)), hn::TableLookupBytes(table, high));
}

/// One bit position of three numbers: a + b + c = sum + 2 carry.
struct BitSum {
  Vec8 sum, carry;
};
HWY_INLINE BitSum add_bits(Vec8 a, Vec8 b, Vec8 c) {
  const Vec8 either = hn::Xor(a, b);
  return {hn::Xor(either, c), hn::Or(hn::And(a, b), hn::And(either, c))};
}

/// Ones in the bytes of six vectors together: without an instruction for it, adders on all
/// bits at once leave three vectors to count.
HWY_INLINE Vec8 ones_of_six(const Vec8* v) {
#if HWY_TARGET == HWY_AVX3_DL
  Vec8 sum = hn::PopulationCount(v[0]);
  for (int i = 1; i < 6; ++i) sum = hn::Add(sum, hn::PopulationCount(v[i]));
  return sum;
#else
  const BitSum low = add_bits(v[0], v[1], v[2]), high = add_bits(v[3], v[4], v[5]);
  const BitSum twos = add_bits(low.carry, high.carry, hn::And(low.sum, high.sum));
  return hn::Add(weighted_ones<1>(hn::Xor(low.sum, high.sum)),
                 hn::Add(weighted_ones<2>(twos.sum), weighted_ones<4>(twos.carry)));
#endif
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
