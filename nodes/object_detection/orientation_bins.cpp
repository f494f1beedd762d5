// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/orientation_bins.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/orientation_bins.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

size_t Values(const uint8_t* bgr, size_t width, uint8_t* value) {
  const hn::ScalableTag<uint8_t> d;
  size_t x = 0;
  for (; x + hn::Lanes(d) <= width; x += hn::Lanes(d)) {
    hn::Vec<decltype(d)> b, g, r;
    hn::LoadInterleaved3(d, bgr + 3 * x, b, g, r);
    hn::StoreU(hn::Max(b, hn::Max(g, r)), d, value + x);
  }
  return x;
}

constexpr hn::ScalableTag<int16_t> kShorts;
constexpr hn::Half<decltype(kShorts)> kHalf;
constexpr hn::Rebind<int32_t, decltype(kHalf)> kInts;
constexpr hn::RebindToFloat<decltype(kInts)> kFloats;
using HalfShorts = hn::Vec<decltype(kHalf)>;

/// Bins between the axis that is nearest to a gradient and the gradient itself; `large` above 0.
class BinsFromAxis {
 public:
  HWY_INLINE BinsFromAxis(const float* slopes, int count)
      : slopes_(slopes),
        linear_(hn::Set(kFloats, 0.6738f * static_cast<float>(count) / 4)),
        square_(hn::Set(kFloats, 0.1738f * static_cast<float>(count) / 4)) {}

  HWY_INLINE HalfShorts operator()(HalfShorts small_component, HalfShorts large_component) const {
    const auto small = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, small_component)),
               large = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, large_component));
    // atan(t) / (pi / 2) = 0.6738 t - 0.1738 t^2 for t in 0..1, within 0.25 degrees; with a reciprocal of 8 bits within
    // 0.4: less than half a bin.
    const auto t = hn::Mul(small, hn::ApproximateReciprocal(large));
    const auto near =
        hn::ConvertTo(kInts, hn::Add(hn::Mul(t, hn::Sub(linear_, hn::Mul(square_, t))), hn::Set(kFloats, 0.5f)));
    const auto border = hn::Mul(hn::GatherIndex(kFloats, slopes_, near), large);
    const auto before = hn::RebindMask(kInts, hn::Lt(small, border));
    return hn::DemoteTo(kHalf, hn::Sub(near, hn::IfThenElseZero(before, hn::Set(kInts, 1))));
  }

 private:
  const float* slopes_;
  hn::Vec<decltype(kFloats)> linear_, square_;
};

/// Pixels 1 .. x - 1 of the row; returns x.
size_t Row(const uint8_t* above, const uint8_t* own, const uint8_t* below, size_t width, const float* slopes, int count,
           uint16_t* index) {
  const hn::Rebind<uint8_t, decltype(kShorts)> u8;
  const hn::RebindToUnsigned<decltype(kShorts)> u16;
  const auto number = [](int value) HWY_ATTR { return hn::Set(kShorts, static_cast<int16_t>(value)); };
  const auto zero = hn::Zero(kShorts), one = number(1), half = number(count / 2), quarter = number(count / 4),
             last_of_quarter = number(count / 4 - 1), none = number(count),
             shortest = number(OrientationBins::kShortest),
             shortest2 = number(OrientationBins::kShortest * OrientationBins::kShortest);
  const BinsFromAxis bins_from_axis(slopes, count);
  const auto value = [&](const uint8_t* at) HWY_ATTR { return hn::PromoteTo(kShorts, hn::LoadU(u8, at)); };
  size_t x = 1;
  for (; x + hn::Lanes(kShorts) < width; x += hn::Lanes(kShorts)) {
    const auto ul = value(above + x - 1), u = value(above + x), ur = value(above + x + 1), l = value(own + x - 1),
               r = value(own + x + 1), dl = value(below + x - 1), b = value(below + x), dr = value(below + x + 1);
    const auto down = hn::Sub(dr, ul), up = hn::Sub(ur, dl);  // along the two diagonals
    const auto gx = hn::Add(hn::Add(down, up), hn::ShiftLeft<1>(hn::Sub(r, l))),
               gy = hn::Add(hn::Sub(down, up), hn::ShiftLeft<1>(hn::Sub(b, u)));
    const auto ax = hn::Abs(gx), ay = hn::Abs(gy);
    // Components beyond the shortest length are as good as that: the squares fit 16 bits.
    const auto cx = hn::Min(ax, shortest), cy = hn::Min(ay, shortest);
    const auto is_short = hn::Lt(hn::Add(hn::Mul(cx, cx), hn::Mul(cy, cy)), shortest2);
    if (hn::AllTrue(kShorts, is_short)) {
      hn::StoreU(hn::BitCast(u16, none), u16, index + x);
      continue;
    }
    // Turned by whole quarters into the first one: first > 0 and second >= 0 unless the gradient is zero.
    const auto right = hn::Gt(gx, zero), left = hn::Lt(gx, zero), downward = hn::Gt(gy, zero),
               upward = hn::Lt(gy, zero);
    const auto odd = hn::Or(hn::AndNot(right, downward), hn::AndNot(left, upward));
    const auto second_half = hn::Or(upward, hn::AndNot(downward, left));
    const auto first = hn::IfThenElse(odd, ay, ax), second = hn::IfThenElse(odd, ax, ay);
    const auto small = hn::Min(first, second), large = hn::Max(one, hn::Max(first, second));
    auto bin = hn::Combine(kShorts, bins_from_axis(hn::UpperHalf(kHalf, small), hn::UpperHalf(kHalf, large)),
                           bins_from_axis(hn::LowerHalf(kHalf, small), hn::LowerHalf(kHalf, large)));
    // From the quarter's end back; only multiples of 45 degrees lie on a border, and none of them is beyond 45 here.
    bin = hn::IfThenElse(hn::Gt(second, first), hn::Sub(last_of_quarter, bin), bin);
    bin = hn::Add(bin, hn::Add(hn::IfThenElseZero(odd, quarter), hn::IfThenElseZero(second_half, half)));
    hn::StoreU(hn::BitCast(u16, hn::IfThenElse(is_short, none, bin)), u16, index + x);
  }
  return x;
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Values);
HWY_EXPORT(Row);

namespace {

constexpr int kLargest = 4 * 255;  // of a component of the gradient

}  // namespace

OrientationBins::OrientationBins(int count) : count_(count) {
  if (count < 4 || count > 360 || count % 4 != 0)
    throw std::invalid_argument("orientations are " + std::to_string(count) + ", must be a multiple of 4 in 4 .. 360");
  slopes_.push_back(0);
  for (int i = 1; i <= count / 8; ++i) {
    const double slope = std::tan(2 * std::numbers::pi * i / count);
    double before = 0, beyond = 1;
    for (int q = 1; q <= kLargest; ++q) {
      const double p = std::ceil(slope * q - 1e-9);  // on a border lies only 45 degrees: 1, but for rounding
      before = std::max(before, (p - 1) / q);
      beyond = std::min(beyond, p / q);
    }
    slopes_.push_back(static_cast<float>((before + beyond) / 2));
  }
  slopes_.push_back(2);
}

uint16_t OrientationBins::of(int gx, int gy) const {
  if (gx * gx + gy * gy < kShortest * kShortest) return none();
  int quarters = 0;
  for (; gx <= 0 || gy < 0; ++quarters) gx = std::exchange(gy, -gx);
  const auto small = static_cast<float>(std::min(gx, gy)), large = static_cast<float>(std::max(gx, gy));
  const auto reached = [&](float slope) { return small >= slope * large; };
  const auto bin =
      static_cast<int>(std::partition_point(slopes_.begin(), slopes_.end(), reached) - slopes_.begin()) - 1;
  const int quarter = count_ / 4;
  return static_cast<uint16_t>(quarters * quarter + (gy > gx ? quarter - 1 - bin : bin));
}

void OrientationBins::values(const uint8_t* bgr, size_t width, uint8_t* value) {
  for (size_t x = HWY_DYNAMIC_DISPATCH(Values)(bgr, width, value); x < width; ++x)
    value[x] = std::max({bgr[3 * x], bgr[3 * x + 1], bgr[3 * x + 2]});
}

void OrientationBins::row(const uint8_t* above, const uint8_t* own, const uint8_t* below, size_t width,
                          uint16_t* index) const {
  size_t x = HWY_DYNAMIC_DISPATCH(Row)(above, own, below, width, slopes_.data(), count_, index);
  for (; x + 1 < width; ++x) {
    const int down = below[x + 1] - above[x - 1], up = above[x + 1] - below[x - 1];
    index[x] = of(down + up + 2 * (own[x + 1] - own[x - 1]), down - up + 2 * (below[x] - above[x]));
  }
  index[0] = index[width - 1] = none();
}

void OrientationBins::rows(ImageView<const uint8_t> bgr, int from, int to, uint8_t* values, uint16_t* index) const {
  const auto width = static_cast<size_t>(bgr.width);
  const auto value_row = [&](int y) { return values + static_cast<size_t>(y) % kValueRows * width; };
  const auto prepare = [&](int y) {
    if (y >= 0 && y < bgr.height) this->values(bgr.row(y), width, value_row(y));
  };
  prepare(from - 1);
  prepare(from);
  for (int y = from; y < to; ++y, index += width) {
    prepare(y + 1);
    if (y == 0 || y + 1 == bgr.height) std::fill_n(index, width, none());
    else row(value_row(y - 1), value_row(y), value_row(y + 1), width, index);
  }
}

}  // namespace takt::object_detection
#endif
