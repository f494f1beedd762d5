// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/path_kernel.hpp"

#include <algorithm>
#include <cstring>

#define TAKT_STEREO_COUNTS_ONES
#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/path_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "nodes/stereo/count_ones-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kByteLanes = static_cast<int>(hn::MaxLanes(kByteTag));

/// The costs of a path at the disparities of one vector, as their neighbours need them.
struct Costs {
#if HWY_TARGET == HWY_AVX3_DL
  Vec8 here, up, down;  ///< as they are; turned by one lane in either direction

  HWY_INLINE explicit Costs(Vec8 v) : here(v) {
    HWY_ALIGN static constexpr uint8_t kUp[64] = {63, 0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14,
                                                  15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30,
                                                  31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46,
                                                  47, 48, 49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62};
    HWY_ALIGN static constexpr uint8_t kDown[64] = {1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16,
                                                    17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32,
                                                    33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47, 48,
                                                    49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 0};
    up = Vec8{_mm512_permutexvar_epi8(_mm512_load_si512(kUp), v.raw)};
    down = Vec8{_mm512_permutexvar_epi8(_mm512_load_si512(kDown), v.raw)};
  }
#else
  Vec8 here;
  HWY_INLINE explicit Costs(Vec8 v) : here(v) {}
#endif
};

/// Every lane moved up by one; the last lane of `before` enters.
HWY_INLINE Vec8 one_up(const Costs& v, const Costs& before) {
#if HWY_TARGET == HWY_AVX3_DL
  return Vec8{_mm512_mask_blend_epi8(1, v.up.raw, before.up.raw)};
#elif HWY_TARGET == HWY_AVX3
  const __m512i carry = _mm512_alignr_epi64(v.here.raw, before.here.raw, 6);
  return Vec8{_mm512_alignr_epi8(v.here.raw, carry, 15)};
#elif HWY_TARGET == HWY_AVX2
  const __m256i carry = _mm256_permute2x128_si256(before.here.raw, v.here.raw, 0x21);
  return Vec8{_mm256_alignr_epi8(v.here.raw, carry, 15)};
#else
  return hn::CombineShiftRightBytes<kByteLanes - 1>(kByteTag, v.here, before.here);
#endif
}

/// Every lane moved down by one; the first lane of `after` enters.
HWY_INLINE Vec8 one_down(const Costs& v, const Costs& after) {
#if HWY_TARGET == HWY_AVX3_DL
  return Vec8{_mm512_mask_blend_epi8(uint64_t{1} << 63, v.down.raw, after.down.raw)};
#elif HWY_TARGET == HWY_AVX3
  const __m512i carry = _mm512_alignr_epi64(after.here.raw, v.here.raw, 2);
  return Vec8{_mm512_alignr_epi8(carry, v.here.raw, 1)};
#elif HWY_TARGET == HWY_AVX2
  const __m256i carry = _mm256_permute2x128_si256(v.here.raw, after.here.raw, 0x21);
  return Vec8{_mm256_alignr_epi8(carry, v.here.raw, 1)};
#else
  return hn::CombineShiftRightBytes<1>(kByteTag, after.here, v.here);
#endif
}

/// One number, where it was found: on its way to other lanes it need not pass through a register for numbers.
struct Number {
#if HWY_TARGET <= HWY_AVX2
  __m128i low;  ///< in its first byte

  HWY_INLINE uint8_t value() const { return static_cast<uint8_t>(_mm_cvtsi128_si32(low)); }
#if HWY_TARGET <= HWY_AVX3
  HWY_INLINE Vec8 everywhere() const { return Vec8{_mm512_broadcastb_epi8(low)}; }
#else
  HWY_INLINE Vec8 everywhere() const { return Vec8{_mm256_broadcastb_epi8(low)}; }
#endif
  HWY_INLINE static Number of(uint8_t value) { return {_mm_cvtsi32_si128(value)}; }
#else
  uint8_t number;

  HWY_INLINE uint8_t value() const { return number; }
  HWY_INLINE Vec8 everywhere() const { return hn::Set(kByteTag, number); }
  HWY_INLINE static Number of(uint8_t value) { return {value}; }
#endif
};

/// Smallest of sixteen bytes.
HWY_INLINE Number smallest_of_16(hn::Vec<hn::FixedTag<uint8_t, 16>> bytes) {
  const hn::FixedTag<uint8_t, 16> sixteen;
  const hn::FixedTag<uint16_t, 8> eight;
  // The upper byte of each word is 0 then.
  const auto words =
      hn::BitCast(eight, hn::Min(bytes, hn::BitCast(sixteen, hn::ShiftRight<8>(hn::BitCast(eight, bytes)))));
#if HWY_TARGET <= HWY_AVX2
  return {_mm_minpos_epu16(words.raw)};
#else
  return {static_cast<uint8_t>(hn::GetLane(hn::MinOfLanes(eight, words)))};
#endif
}

/// Smallest lane of each.
struct Smallest {
  Number of_first, of_second;
};
HWY_INLINE Smallest smallest_lanes(Vec8 first, Vec8 second) {
#if HWY_TARGET <= HWY_AVX3
  // Both together, as far as that goes.
  const __m512i a = first.raw, b = second.raw;
  const __m512i halves = _mm512_min_epu8(_mm512_shuffle_i64x2(a, b, 0x44), _mm512_shuffle_i64x2(a, b, 0xEE));
  const __m512i quarters = _mm512_min_epu8(halves, _mm512_shuffle_i64x2(halves, halves, 0xB1));
  using Sixteen = hn::Vec<hn::FixedTag<uint8_t, 16>>;
  return {smallest_of_16(Sixteen{_mm512_castsi512_si128(quarters)}),
          smallest_of_16(Sixteen{_mm512_extracti32x4_epi32(quarters, 2)})};
#elif HWY_TARGET == HWY_AVX2
  const hn::FixedTag<uint8_t, 16> sixteen;
  const auto halved = [&](Vec8 v) HWY_ATTR { return hn::Min(hn::LowerHalf(sixteen, v), hn::UpperHalf(sixteen, v)); };
  return {smallest_of_16(halved(first)), smallest_of_16(halved(second))};
#else
  return {smallest_of_16(first), smallest_of_16(second)};
#endif
}

/// What a path pays to come to a pixel, of those before: the cheapest way, less the least of them.
class Ways {
 public:
  HWY_INLINE Ways(Number least, const PathRow& row)
      : p1_(hn::Set(kByteTag, row.p1)), p2_(hn::Set(kByteTag, row.p2)), least_(least.everywhere()) {}
  /// `straight`: at the same disparity; `beside`: the cheaper one of its neighbours.
  HWY_INLINE Vec8 cheapest(Vec8 straight, Vec8 beside) const {
    return hn::Min(hn::Sub(hn::Min(straight, hn::SaturatedAdd(beside, p1_)), least_), p2_);
  }

 private:
  Vec8 p1_, p2_, least_;
};

/// One path through a pixel: takes its costs at the pixel before, vector by vector, and leaves those here.
class Path {
 public:
  HWY_INLINE Path(uint8_t* costs, Number least, const PathRow& row)
      : costs_(costs),
        ways_(least, row),
        least_(hn::Set(kByteTag, 255)),
        before_(least_),
        here_(hn::Load(kByteTag, costs)) {}

  /// Vector j of `last` + 1 in rising order.
  HWY_INLINE Vec8 advance(int j, int last, Vec8 cost) {
    const Costs after(j < last ? hn::Load(kByteTag, costs_ + (j + 1) * kByteLanes) : hn::Set(kByteTag, 255));
    const Vec8 way = ways_.cheapest(here_.here, hn::Min(one_up(here_, before_), one_down(here_, after)));
    const Vec8 total = hn::SaturatedAdd(cost, way);
    hn::Store(total, kByteTag, costs_ + j * kByteLanes);
    before_ = here_;
    here_ = after;
    least_ = hn::Min(least_, total);
    return total;
  }
  HWY_INLINE Vec8 least() const { return least_; }  ///< its smallest lane

 private:
  uint8_t* costs_;
  const Ways ways_;
  Vec8 least_;
  Costs before_, here_;
};

/// The same of the path from above, whose costs lie in memory since the row before: neighbours are loaded from beside
/// them, where there is 255 before the first and behind the last of a pixel.
class PathFromAbove {
 public:
  HWY_INLINE PathFromAbove(const uint8_t* before, uint8_t* here, Number least, const PathRow& row)
      : before_(before), here_(here), ways_(least, row), least_(hn::Set(kByteTag, 255)) {}

  HWY_INLINE Vec8 advance(int j, Vec8 cost) {
    const uint8_t* at = before_ + j * kByteLanes;
    const Vec8 beside = hn::Min(hn::LoadU(kByteTag, at - 1), hn::LoadU(kByteTag, at + 1));
    const Vec8 total = hn::SaturatedAdd(cost, ways_.cheapest(hn::Load(kByteTag, at), beside));
    hn::Store(total, kByteTag, here_ + j * kByteLanes);
    least_ = hn::Min(least_, total);
    return total;
  }
  HWY_INLINE Vec8 least() const { return least_; }

 private:
  const uint8_t* before_;
  uint8_t* here_;
  const Ways ways_;
  Vec8 least_;
};

/// Hamming distances of pixel x to the pixels x - d.
class CensusCost {
 public:
  HWY_INLINE CensusCost(const PathRow& row, int x)
      : row_(row), offset_(row.width - 1 - x), c_max_(hn::Set(kByteTag, row.c_max)) {
    for (int p = 0; p < kPlanes; ++p) left_[p] = hn::Set(kByteTag, row.left[p][x]);
  }
  /// Vector j of `last` + 1. Of the others no lane lies beyond the search range; kOutside: some pixel x - d may lie
  /// outside the image.
  template <bool kOutside>
  HWY_INLINE Vec8 at(int j, int last) const {
    const ptrdiff_t d = ptrdiff_t{j} * kByteLanes;
    Vec8 differences[kPlanes];
    for (int p = 0; p < kPlanes; ++p)
      differences[p] = hn::Xor(left_[p], hn::LoadU(kByteTag, row_.right[p] + offset_ + d));
    Vec8 cost = hn::Min(ones_of_six(differences), c_max_);
    if constexpr (kOutside) cost = hn::Max(cost, hn::LoadU(kByteTag, row_.outside + offset_ + d));
    return j < last ? cost : hn::Max(cost, hn::Load(kByteTag, row_.beyond + d));
  }

 private:
  static constexpr int kPlanes = planes_of(CostKind::census);
  const PathRow& row_;
  ptrdiff_t offset_;
  Vec8 c_max_;
  Vec8 left_[kPlanes];
};

/// The paths from the left and from above, pixel by pixel. kVectors: of one pixel, known to the compiler; 0: as many as
/// the row says.
template <int kVectors>
class Forward {
 public:
  HWY_INLINE explicit Forward(const PathRow& row) : row_(row) {
    std::memset(row.from_left, 0, static_cast<size_t>(row.vectors * kByteLanes));
  }
  /// The next one, x = 0, 1, 2 ...
  template <bool kOutside>
  HWY_INLINE void advance(int x) {
    const int last = (kVectors > 0 ? kVectors : row_.vectors) - 1;
    const ptrdiff_t stride = ptrdiff_t{last + 1} * kByteLanes;
    const CensusCost cost(row_, x);
    const ptrdiff_t above_at = x * row_.above_stride;
    Path beside(row_.from_left, least_, row_);
    PathFromAbove above(row_.above + above_at, row_.above_here + above_at, Number::of(row_.above_least[x]), row_);
    for (int j = 0; j <= last; ++j) {
      const Vec8 c = cost.at<kOutside>(j, last);
      hn::Store(c, kByteTag, row_.costs + x * stride + j * kByteLanes);
      hn::Store(hn::SaturatedAdd(beside.advance(j, last, c), above.advance(j, c)), kByteTag,
                row_.sums + x * stride + j * kByteLanes);
    }
    const Smallest smallest = smallest_lanes(beside.least(), above.least());
    least_ = smallest.of_first;
    row_.above_least[x] = smallest.of_second.value();
  }

 private:
  const PathRow row_;             ///< a copy: stores of bytes could change the original for all that the compiler knows
  Number least_ = Number::of(0);  ///< of the path from the left
};

/// The first lane of the totals that holds the value.
HWY_INLINE int find(const uint8_t* totals, uint8_t value) {
  const Vec8 wanted = hn::Set(kByteTag, value);
  for (int d = 0;; d += kByteLanes) {
    const auto found = hn::FindFirstTrue(kByteTag, hn::Eq(hn::Load(kByteTag, totals + d), wanted));
    if (found >= 0) return d + static_cast<int>(found);
  }
}

/// Second best total at more than one pixel from d is not far enough above the best.
bool ambiguous(const PathRow& row, int best, int d) {
  auto second = static_cast<uint8_t>(3 * (row.c_max + row.p2));
  for (int e = 0; e < row.disparities; ++e)
    if (e < d - 1 || e > d + 1) second = std::min(second, row.totals[e]);
  return (second - best) * 256 <= row.uniqueness * second;
}

/// The path from the right and the winners, pixel by pixel.
template <int kVectors>
class Backward {
 public:
  HWY_INLINE explicit Backward(const PathRow& row) : row_(row) {
    std::memset(row.from_right, 0, static_cast<size_t>(row.vectors * kByteLanes));
  }
  /// The next one, x = width - 1, width - 2 ...
  HWY_INLINE void advance(int x) {
    const int last = (kVectors > 0 ? kVectors : row_.vectors) - 1;
    const ptrdiff_t stride = ptrdiff_t{last + 1} * kByteLanes;
    Path beside(row_.from_right, least_, row_);
    Vec8 lowest = hn::Set(kByteTag, 255);
    for (int j = 0; j <= last; ++j) {
      const ptrdiff_t at = x * stride + j * kByteLanes;
      const Vec8 total = hn::SaturatedAdd(hn::Load(kByteTag, row_.sums + at),
                                          beside.advance(j, last, hn::Load(kByteTag, row_.costs + at)));
      hn::Store(total, kByteTag, row_.totals + j * kByteLanes);
      lowest = hn::Min(lowest, total);
    }
    const Smallest smallest = smallest_lanes(beside.least(), lowest);
    least_ = smallest.of_first;
    const uint8_t best = smallest.of_second.value();
    const int d = find(row_.totals, best);
    const bool fits = row_.subpixel && d > 0 && d + 1 < row_.disparities;
    const int fraction = fits ? fraction_of(row_.totals[d - 1], best, row_.totals[d + 1]) : kNoFraction;
    row_.fine[x] = static_cast<int16_t>(d * kFractions + fraction);
    row_.least[x] = best;
    if (row_.uniqueness > 0) row_.ambiguous[x] = ambiguous(row_, best, d);
  }

 private:
  const PathRow row_;             ///< see Forward
  Number least_ = Number::of(0);  ///< of the path from the right
};

/// Pixels from .. to - 1 of the one, and of the other as many from the right. Each waits for its own pixel before most
/// of the time; so the processor does one while the other waits.
template <bool kOutside, int kVectors>
HWY_INLINE void advance(Forward<kVectors>& forward, Backward<kVectors>* backward, int from, int to, int width) {
  for (int x = from; x < to; ++x) {
    forward.template advance<kOutside>(x);
    if (backward != nullptr) backward->advance(width - 1 - x);
  }
}

template <int kVectors>
void run(const PathRow* next, const PathRow* finished) {
  if (next == nullptr) {
    Backward<kVectors> backward(*finished);
    for (int x = finished->width - 1; x >= 0; --x) backward.advance(x);
    return;
  }
  Forward<kVectors> forward(*next);
  const int width = next->width, inside = std::min(width, next->vectors * kByteLanes);
  if (finished == nullptr) {
    advance<true, kVectors>(forward, nullptr, 0, inside, width);
    advance<false, kVectors>(forward, nullptr, inside, width, width);
    return;
  }
  Backward<kVectors> backward(*finished);
  advance<true>(forward, &backward, 0, inside, width);
  advance<false>(forward, &backward, inside, width, width);
}

void run_rows(const PathRow* next, const PathRow* finished) {
  switch ((next != nullptr ? next : finished)->vectors) {
    case 1: return run<1>(next, finished);
    case 2: return run<2>(next, finished);
    case 3: return run<3>(next, finished);
    case 4: return run<4>(next, finished);
    case 5: return run<5>(next, finished);
    default: return run<0>(next, finished);
  }
}

const PathKernels& target_path_kernels() {
  static const PathKernels table{hwy::TargetName(HWY_TARGET), kByteLanes, run_rows};
  return table;
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_path_kernels);
const PathKernels& path_kernels() { return HWY_DYNAMIC_DISPATCH(target_path_kernels)(); }
}  // namespace takt::stereo
#endif
