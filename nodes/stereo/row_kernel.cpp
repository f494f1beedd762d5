// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/row_kernel.hpp"

#include <algorithm>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/row_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "nodes/stereo/count_ones-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kBytes;
constexpr hn::ScalableTag<int8_t> kSigned;
constexpr hn::ScalableTag<uint16_t> kWords;
using Bytes = hn::Vec<decltype(kBytes)>;
using Words = hn::Vec<decltype(kWords)>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kWords));
constexpr int kChunk = 2 * kLanes;

/// Even and odd bytes, each times a small factor, as words: v * factors summed over byte pairs, one factor being 0.
HWY_INLINE Words scaled_bytes(Bytes v, Bytes factors) {
#if HWY_TARGET == HWY_AVX3
  return Words{_mm512_maddubs_epi16(v.raw, factors.raw)};
#elif HWY_TARGET == HWY_AVX2
  return Words{_mm256_maddubs_epi16(v.raw, factors.raw)};
#elif HWY_TARGET == HWY_SSE4
  return Words{_mm_maddubs_epi16(v.raw, factors.raw)};
#else
  const Words low_byte = hn::Set(kWords, 0xFF);
  const Words w = hn::BitCast(kWords, v), f = hn::BitCast(kWords, factors);
  return hn::Add(hn::Mul(hn::And(w, low_byte), hn::And(f, low_byte)),
                 hn::Mul(hn::ShiftRight<8>(w), hn::ShiftRight<8>(f)));
#endif
}

/// |a - b| of signed bytes, exact up to 127 and at least 127 beyond; truncation takes the difference away.
HWY_INLINE Bytes signed_distance(Bytes a, Bytes b) {
  return hn::BitCast(kBytes, hn::Abs(hn::SaturatedSub(hn::BitCast(kSigned, a), hn::BitCast(kSigned, b))));
}

/// The truncated cost of one pixel against a chunk of disparities.
template <CostKind kKind>
class Cost {
 public:
  explicit Cost(const RowJob& job) : job_(job), c_max_(hn::Set(kBytes, static_cast<uint8_t>(job.c_max))) {
    HWY_ALIGN uint8_t squares[16];
    for (int i = 0; i < 16; ++i) squares[i] = static_cast<uint8_t>(std::min(i * i, job.c_max));
    squares_ = hn::LoadDup128(kBytes, squares);
  }

  /// `index`: column - first_column.
  HWY_INLINE void select(ptrdiff_t index) {
    for (int p = 0; p < kPlanes; ++p)
      left_[p] = hn::BitCast(kBytes, hn::Set(hn::ScalableTag<uint32_t>(), job_.left[p][index]));
    offset_ = 2 * (ptrdiff_t{job_.last_column} - job_.first_column - index);
  }

  template <bool kOutside>
  HWY_INLINE Bytes at(int chunk) const {
    const ptrdiff_t offset = offset_ + ptrdiff_t{2} * kChunk * chunk;
    Bytes differences[kPlanes];
    for (int p = 0; p < kPlanes; ++p) differences[p] = distance(left_[p], hn::LoadU(kBytes, job_.right[p] + offset));
    Bytes sum = hn::Min(total(differences), c_max_);
    if (kOutside) sum = hn::Max(sum, hn::LoadU(kBytes, job_.outside + offset));
    return sum;
  }

 private:
  static constexpr int kPlanes = planes_of(kKind);

  HWY_INLINE Bytes distance(Bytes a, Bytes b) const {
    if constexpr (kKind == CostKind::gradient) return signed_distance(a, b);
    if constexpr (kKind == CostKind::census) return hn::Xor(a, b);
    if constexpr (kKind == CostKind::sad) return hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a));
    // The bytes are biased by 0x80. |difference| >= 15 costs 225, which is at least c_max (validated).
    return hn::TableLookupBytes(squares_, hn::Min(signed_distance(a, b), hn::Set(kBytes, 15)));
  }

  static HWY_INLINE Bytes total(const Bytes* differences) {
    if constexpr (kKind == CostKind::census) return ones_of_six(differences);
    // Planes of the gradient hold twice the derivative: the sum of the distances is the mean of those of the planes.
    if constexpr (kKind == CostKind::gradient) return hn::AverageRound(differences[0], differences[1]);
    return hn::SaturatedAdd(hn::SaturatedAdd(differences[0], differences[1]), differences[2]);
  }

  const RowJob job_;  // a copy: stores of bytes could change the original for all that the compiler knows
  Bytes c_max_, squares_;
  Bytes left_[kPlanes];
  ptrdiff_t offset_ = 0;
};

/// kGroups vectors of sums in registers, or (0) as many as the job says, in memory, with uniqueness and sub-pixel fit.
/// Sums are scaled by the number of groups and carry the group in the remainder, so that one minimum finds both.
template <CostKind kKind, bool kNarrow, int kGroups>
class Rows {
 public:
  static void fill(const RowJob& job) {
    Rows rows(job);
    for (int c = job.first_column; c <= job.last_column; ++c) {
      rows.cost_.select(c - job.first_column);
      for (int j = 0; j < rows.chunks(); ++j)
        hn::Store(rows.cost_.template at<true>(j), kBytes, job.ring_new + rows.place(c, j));
    }
  }

  static void roll(const RowJob& job) {
    Rows rows(job);
    for (int c = job.first_column; c <= job.last_column; ++c)
      for (int j = 0; j < rows.chunks(); ++j)
        rows.roll_chunk(rows.place(c, j), hn::Load(kBytes, job.ring_new + rows.place(c, j)));
  }

  static void decide(const RowJob& job) {
    Rows rows(job);
    const int ahead = std::min(job.image_width, job.x_begin + job.radius);
    // Costs whose search pixel may lie outside the image need a mask; they stand in the columns before `inside`.
    const int inside = job.first_disparity + rows.chunks() * kChunk - 1;
    if (job.new_row)
      for (int c = job.first_column; c < ahead; ++c) rows.template new_column<true>(c);
    rows.start_sums();
    const int last_new = job.new_row ? std::min(job.x_end, job.image_width - job.radius) : job.x_begin;
    const int last_masked = std::clamp(inside - job.radius, job.x_begin, std::max(job.x_begin, last_new));
    rows.template walk<true, true>(job.x_begin, std::min(last_masked, last_new));
    rows.template walk<true, false>(std::min(last_masked, last_new), last_new);
    rows.template walk<false, false>(std::max(job.x_begin, last_new), job.x_end);
    rows.write_keys();
  }

 private:
  static constexpr bool kInMemory = kGroups == 0;
  static constexpr int kRegisters = kInMemory ? 1 : kGroups;
  static constexpr int kChunks = (kRegisters + 1) / 2;

  explicit Rows(const RowJob& job)
      : job_(job), cost_(job), scale_(kInMemory ? 1 : kGroups), tail_(hn::LoadU(kWords, job.tail)) {
    const Words factor = hn::Set(kWords, static_cast<uint16_t>(scale_));
    even_ = hn::BitCast(kBytes, factor);
    odd_ = hn::BitCast(kBytes, hn::ShiftLeft<8>(factor));
  }

  HWY_INLINE int groups() const { return kInMemory ? job_.groups : kGroups; }
  HWY_INLINE int chunks() const { return (groups() + 1) / 2; }
  HWY_INLINE ptrdiff_t place(int column, int chunk) const {
    return ptrdiff_t{kChunk} * (ptrdiff_t{column - job_.first_column} * chunks() + chunk);
  }
  HWY_INLINE uint8_t* narrow() const { return static_cast<uint8_t*>(job_.columns); }
  HWY_INLINE uint16_t* wide() const { return static_cast<uint16_t*>(job_.columns); }

  HWY_INLINE void roll_chunk(ptrdiff_t at, Bytes cost) const {
    const Bytes old = hn::Load(kBytes, job_.ring_old + at);
    if constexpr (kNarrow) {
      hn::Store(hn::Sub(hn::Add(hn::Load(kBytes, narrow() + at), cost), old), kBytes, narrow() + at);
    } else {
      uint16_t* even = wide() + at;
      uint16_t* odd = even + kLanes;
      hn::Store(hn::Sub(hn::Add(hn::Load(kWords, even), scaled_bytes(cost, even_)), scaled_bytes(old, even_)), kWords,
                even);
      hn::Store(hn::Sub(hn::Add(hn::Load(kWords, odd), scaled_bytes(cost, odd_)), scaled_bytes(old, odd_)), kWords,
                odd);
    }
  }

  template <bool kOutside>
  HWY_INLINE void new_column(int column) {
    cost_.select(column - job_.first_column);
    for (int j = 0; j < chunks(); ++j) {
      const Bytes cost = cost_.template at<kOutside>(j);
      const ptrdiff_t at = place(column, j);
      roll_chunk(at, cost);
      hn::Store(cost, kBytes, job_.ring_new + at);
    }
  }

  /// Narrow sums of group g's chunk as scaled words.
  HWY_INLINE Words widened(Bytes chunk, int g) const { return scaled_bytes(chunk, g % 2 ? odd_ : even_); }

  /// Vertical sum of one column as scaled words of group g.
  HWY_INLINE Words column_sum(int column, int g) const {
    const ptrdiff_t at = place(column, g / 2);
    if constexpr (kNarrow) return widened(hn::Load(kBytes, narrow() + at), g);
    return hn::Load(kWords, wide() + at + (g % 2) * kLanes);
  }
  HWY_INLINE int clamped(int column) const { return std::clamp(column, 0, job_.image_width - 1); }

  /// Window sums of the pixel left of x_begin (replicated border), from which walk() goes on.
  HWY_INLINE void start_sums() {
    for (int g = 0; g < groups(); ++g) {
      Words sum = hn::Set(kWords, static_cast<uint16_t>(kInMemory ? 0 : g));
      for (int k = -job_.radius - 1; k < job_.radius; ++k) sum = hn::Add(sum, column_sum(clamped(job_.x_begin + k), g));
      if constexpr (kInMemory) hn::StoreU(sum, kWords, job_.sums + g * kLanes);
      else sums_[g] = sum;
    }
  }

  template <bool kNew, bool kOutside>
  HWY_INLINE void walk(int from, int to) {
    if constexpr (kInMemory) walk_in_memory<kNew, kOutside>(from, to);
    else walk_registers<kNew, kOutside>(from, to);
  }

  /// new_column() of narrow sums, which stay in `column`, too. Nothing else may point to `sums`: the compiler then need
  /// not read again what it has just stored.
  template <bool kOutside>
  HWY_INLINE void new_narrow_column(ptrdiff_t index, const uint8_t* ring_old, uint8_t* ring_new,
                                    uint8_t* HWY_RESTRICT sums, Bytes* column) {
    cost_.select(index);
    for (int j = 0; j < kChunks; ++j) {
      const ptrdiff_t at = (index * kChunks + j) * kChunk;
      const Bytes cost = cost_.template at<kOutside>(j);
      column[j] = hn::Sub(hn::Add(hn::Load(kBytes, sums + at), cost), hn::Load(kBytes, ring_old + at));
      hn::Store(column[j], kBytes, sums + at);
      hn::Store(cost, kBytes, ring_new + at);
    }
  }

  /// Columns are counted from first_column here, and what changes in the loop are few locals: a fifth of the time goes
  /// with addresses otherwise. Told that the loop runs at least once, GCC keeps them in registers with AVX2, too (15
  /// %).
  template <bool kNew, bool kOutside>
  HWY_INLINE void walk_registers(int from, int to) {
    if (from >= to) return;
    Words sums[kRegisters];
    for (int g = 0; g < kRegisters; ++g) sums[g] = sums_[g];
    uint8_t* HWY_RESTRICT columns = narrow();
    const uint8_t* ring_old = job_.ring_old;
    uint8_t* ring_new = job_.ring_new;
    uint32_t* HWY_RESTRICT winner = job_.winners + (from - job_.x_begin);
    const ptrdiff_t first = -job_.first_column, last = job_.image_width - 1 + first, window = 2 * job_.radius + 1;
    ptrdiff_t index = from + job_.radius + first;
    for (const ptrdiff_t end = index + to - from; index < end; ++index) {
      const ptrdiff_t enters = kNew ? index : std::min(index, last), leaves = std::max(index - window, first);
      if constexpr (kNarrow) {
        Bytes column[kChunks];
        if constexpr (kNew) new_narrow_column<kOutside>(enters, ring_old, ring_new, columns, column);
        else
          for (int j = 0; j < kChunks; ++j) column[j] = hn::Load(kBytes, columns + (enters * kChunks + j) * kChunk);
        const uint8_t* leaving = columns + leaves * kChunks * kChunk;
        for (int g = 0; g < kRegisters; ++g) sums[g] = hn::Add(sums[g], widened(column[g / 2], g));
        for (int g = 0; g < kRegisters; ++g)
          sums[g] = hn::Sub(sums[g], widened(hn::Load(kBytes, leaving + g / 2 * kChunk), g));
      } else {
        const int entering = job_.first_column + static_cast<int>(enters);
        if constexpr (kNew) new_column<kOutside>(entering);
        for (int g = 0; g < kRegisters; ++g)
          sums[g] = hn::Sub(hn::Add(sums[g], column_sum(entering, g)),
                            column_sum(job_.first_column + static_cast<int>(leaves), g));
      }
      Words best = hn::Or(sums[kRegisters - 1], tail_);
      for (int g = 0; g + 1 < kRegisters; ++g) best = hn::Min(best, sums[g]);
      const uint32_t smallest = smallest_lane(best);
      const size_t lane =
          hn::FindKnownFirstTrue(kWords, hn::Eq(best, hn::Set(kWords, static_cast<uint16_t>(smallest))));
      *winner++ = smallest << 8 | static_cast<uint32_t>(lane);
    }
    for (int g = 0; g < kRegisters; ++g) sums_[g] = sums[g];
  }

  template <bool kNew, bool kOutside>
  HWY_INLINE void walk_in_memory(int from, int to) {
    for (int x = from; x < to; ++x) {
      const int enters = std::min(x + job_.radius, job_.image_width - 1), leaves = std::max(x - job_.radius - 1, 0);
      if constexpr (kNew) new_column<kOutside>(enters);
      for (int g = 0; g < groups(); ++g) {
        uint16_t* sums = job_.sums + g * kLanes;
        hn::StoreU(hn::Sub(hn::Add(hn::LoadU(kWords, sums), column_sum(enters, g)), column_sum(leaves, g)), kWords,
                   sums);
      }
      const uint32_t best = smallest_sum();
      int d = 0;
      const Words wanted = hn::Set(kWords, static_cast<uint16_t>(best));
      while (hn::AllFalse(kWords, hn::Eq(hn::LoadU(kWords, job_.sums + d), wanted))) d += kLanes;
      d += static_cast<int>(hn::FindKnownFirstTrue(kWords, hn::Eq(hn::LoadU(kWords, job_.sums + d), wanted)));
      job_.winners[x - job_.x_begin] = best << 16 | static_cast<uint32_t>(d) << 7 | fraction(best, d) << 1 |
                                       (job_.uniqueness > 0 ? ambiguous(best, d) : 0);
    }
  }

  HWY_INLINE uint32_t smallest_sum() const {
    Words best = hn::Or(hn::LoadU(kWords, job_.sums + (groups() - 1) * kLanes), tail_);
    for (int g = 0; g + 1 < groups(); ++g) best = hn::Min(best, hn::LoadU(kWords, job_.sums + g * kLanes));
    return smallest_lane(best);
  }

  HWY_INLINE uint32_t fraction(uint32_t best, int d) const {
    const uint16_t* at = job_.sums + d;
    if (!job_.subpixel || d == 0 || d + 1 >= job_.disparities) return kNoFraction;
    return static_cast<uint32_t>(fraction_of(at[-1], static_cast<int>(best), at[1]));
  }

  /// Second best sum at more than one pixel from d is not far enough above the best.
  HWY_INLINE uint32_t ambiguous(uint32_t best, int d) const {
    const int low = std::max(0, d - 1), high = std::min(d + 1, groups() * kLanes - 1);
    uint16_t kept[3];
    for (int i = low; i <= high; ++i) {
      kept[i - low] = job_.sums[i];
      job_.sums[i] = 0xFFFF;
    }
    const uint32_t second = smallest_sum();
    for (int i = low; i <= high; ++i) job_.sums[i] = kept[i - low];
    return (second - best) * 256 <= static_cast<uint32_t>(job_.uniqueness) * second ? 1 : 0;
  }

  /// Smallest of all lanes; the machine's own minimum of eight words where it has one.
  static HWY_INLINE uint32_t smallest_lane(Words v) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
    const hn::FixedTag<uint16_t, 8> eight;
#if HWY_TARGET == HWY_AVX3
    const hn::FixedTag<uint16_t, 16> sixteen;
    const auto halves = hn::Min(hn::LowerHalf(sixteen, v), hn::UpperHalf(sixteen, v));
#else
    const auto halves = v;
#endif
    const auto quarters = hn::Min(hn::LowerHalf(eight, halves), hn::UpperHalf(eight, halves));
    return static_cast<uint16_t>(_mm_cvtsi128_si32(_mm_minpos_epu16(quarters.raw)));
#else
    return hn::GetLane(hn::MinOfLanes(kWords, v));
#endif
  }

  /// Winners to keys: sum and group are quotient and remainder of the scaled sum. The reciprocals are exact for all
  /// 16-bit values and divisors 1..6: value * (reciprocal * scale - 2^shift) < 2^shift.
  HWY_INLINE void write_keys() const {
    const int count = job_.x_end - job_.x_begin;
    const auto scale = static_cast<uint32_t>(scale_), first = static_cast<uint32_t>(job_.first_disparity);
    const uint32_t shift = scale == 1 ? 16 : scale <= 3 ? 17 : 18;
    const uint32_t reciprocal = ((1u << shift) + scale - 1) / scale;
    for (int i = 0; i < count; ++i) {
      uint32_t key = job_.winners[i];
      if constexpr (!kInMemory) {
        const uint32_t value = key >> 8, sum = (value * reciprocal) >> shift, group = value - sum * scale;
        key = sum << 16 | (first + group * kLanes + (key & 0xFF)) << 7 | kNoFraction << 1;
      }
      job_.keys[i] = job_.first_block || key < job_.keys[i] ? key : job_.keys[i];
    }
  }

  const RowJob job_;  // a copy, see Cost
  Cost<kKind> cost_;
  int scale_;
  Words tail_;
  Bytes even_, odd_;
  Words sums_[kRegisters];
};

template <CostKind kKind, bool kNarrow, int kGroups>
RowFunctions functions() {
  using R = Rows<kKind, kNarrow, kGroups>;
  return {R::fill, R::roll, R::decide};
}

/// `groups` is one of block_sizes(); 0 stands for any number, in memory.
template <CostKind kKind, bool kNarrow>
RowFunctions functions_of(int groups) {
  if constexpr (kNarrow) {
    if (groups == 4) return functions<kKind, kNarrow, 4>();
    if (groups == 6) return functions<kKind, kNarrow, 6>();
  }
  switch (groups) {
    case 0: return functions<kKind, kNarrow, 0>();
    case 1: return functions<kKind, kNarrow, 1>();
    case 2: return functions<kKind, kNarrow, 2>();
    default: return functions<kKind, kNarrow, 5>();
  }
}

/// For the costs that PlaneMaker serves.
RowFunctions rows(CostKind kind, bool narrow, int groups) {
  if (kind == CostKind::ssd) return functions_of<CostKind::ssd, false>(groups);
  if (kind == CostKind::sad) return functions_of<CostKind::sad, false>(groups);
  if (kind == CostKind::census)
    return narrow ? functions_of<CostKind::census, true>(groups) : functions_of<CostKind::census, false>(groups);
  return narrow ? functions_of<CostKind::gradient, true>(groups) : functions_of<CostKind::gradient, false>(groups);
}

RowFunctions rows_in_memory(CostKind kind, bool narrow) { return rows(kind, narrow, 0); }

void interleave(const uint8_t* reversed, int count, uint8_t* out) {
  for (int i = 0; i < count; i += kChunk)
    hn::StoreInterleaved2(hn::LoadU(kBytes, reversed + i), hn::LoadU(kBytes, reversed + i + kLanes), kBytes,
                          out + 2 * i);
}

const Kernels& target_kernels() {
  static const Kernels table{hwy::TargetName(HWY_TARGET), kLanes, rows, rows_in_memory, interleave};
  return table;
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_kernels);
const Kernels& kernels() { return HWY_DYNAMIC_DISPATCH(target_kernels)(); }
}  // namespace takt::stereo
#endif
