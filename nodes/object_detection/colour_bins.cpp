// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/colour_bins.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/colour_bins.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<int16_t> kShorts;
constexpr hn::RebindToUnsigned<decltype(kShorts)> kIndices;
constexpr hn::Rebind<uint8_t, decltype(kShorts)> kBytes;
constexpr hn::Half<decltype(kShorts)> kHalf;
constexpr hn::Rebind<int32_t, decltype(kHalf)> kInts;
constexpr hn::RebindToFloat<decltype(kInts)> kFloats;
using Shorts = hn::Vec<decltype(kShorts)>;
using HalfShorts = hn::Vec<decltype(kHalf)>;

HWY_INLINE Shorts number(int value) { return hn::Set(kShorts, static_cast<int16_t>(value)); }

/// floor(factor n / d), less than 2^15. Quotients of integers n / d with n < 2^17 and d < 2^11 stay at least 2^-11
/// below the next integer unless they are one, farther than a float rounds: truncation gives the floor exactly.
HWY_INLINE HalfShorts half_quotient(float factor, HalfShorts n, HalfShorts d) {
  const auto scaled = hn::Mul(hn::Set(kFloats, factor), hn::ConvertTo(kFloats, hn::PromoteTo(kInts, n)));
  return hn::DemoteTo(kHalf, hn::ConvertTo(kInts, hn::Div(scaled, hn::ConvertTo(kFloats, hn::PromoteTo(kInts, d)))));
}
HWY_INLINE Shorts quotient(int factor, Shorts n, Shorts d) {
  const auto f = static_cast<float>(factor);
  return hn::Combine(kShorts, half_quotient(f, hn::UpperHalf(kHalf, n), hn::UpperHalf(kHalf, d)),
                     half_quotient(f, hn::LowerHalf(kHalf, n), hn::LowerHalf(kHalf, d)));
}

/// As Hsv.
struct HsvOfMany {
  Shorts hue, spread, high;

  HWY_INLINE explicit HsvOfMany(const uint8_t* bgr) {
    hn::Vec<decltype(kBytes)> b8, g8, r8;
    hn::LoadInterleaved3(kBytes, bgr, b8, g8, r8);
    const auto b = hn::PromoteTo(kShorts, b8), g = hn::PromoteTo(kShorts, g8), r = hn::PromoteTo(kShorts, r8);
    high = hn::Max(b, hn::Max(g, r));
    spread = hn::Sub(high, hn::Min(b, hn::Min(g, r)));
    const auto two = hn::ShiftLeft<1>(spread), four = hn::ShiftLeft<2>(spread);
    const auto of_red = hn::Sub(g, b), of_green = hn::Add(two, hn::Sub(b, r)), of_blue = hn::Add(four, hn::Sub(r, g));
    hue = hn::IfThenElse(hn::Eq(high, r), of_red, hn::IfThenElse(hn::Eq(high, g), of_green, of_blue));
    hue = hn::Add(hue, hn::IfThenElseZero(hn::Lt(hue, hn::Zero(kShorts)), hn::Add(four, two)));
  }
  /// floor(`parts` hue / turn)
  HWY_INLINE Shorts hue_part(int parts) const {
    return quotient(parts, hue, hn::Mul(number(6), hn::Max(spread, number(1))));
  }
};

size_t Bins(const uint8_t* bgr, size_t count, BinSplit split, uint16_t* index) {
  const auto last_saturation = number(split.saturation - 1), hue_step = number(split.saturation),
             values = number(split.value);
  size_t x = 0;
  for (; x + hn::Lanes(kShorts) <= count; x += hn::Lanes(kShorts)) {
    const HsvOfMany c(bgr + 3 * x);
    const auto s = hn::Min(last_saturation, quotient(split.saturation, c.spread, hn::Max(c.high, number(1))));
    const auto v = hn::ShiftRight<8>(hn::Mul(c.high, values));
    const auto bin = hn::Add(hn::Mul(hn::Add(hn::Mul(c.hue_part(split.hue), hue_step), s), values), v);
    hn::StoreU(hn::BitCast(kIndices, bin), kIndices, index + x);
  }
  return x;
}

size_t PairColours(const uint8_t* bgr, size_t count, PairColourSplit split, uint8_t* index) {
  const auto grey_below = number(split.grey_below), twenty = number(20), one = number(1),
             first_hue = number(split.first_hue);
  size_t x = 0;
  for (; x + hn::Lanes(kShorts) <= count; x += hn::Lanes(kShorts)) {
    const HsvOfMany c(bgr + 3 * x);
    const auto from = [&](int value) HWY_ATTR { return hn::Gt(c.high, number(value - 1)); };
    const auto grey = hn::Add(
        one, hn::Add(hn::IfThenElseZero(from(split.mid_from), one), hn::IfThenElseZero(from(split.bright_from), one)));
    const auto is_grey = hn::Lt(hn::Mul(twenty, c.spread), hn::Mul(grey_below, c.high));
    auto colour = hn::IfThenElse(is_grey, grey, hn::Add(first_hue, c.hue_part(split.hues)));
    colour = hn::IfThenElseZero(from(split.black_below), colour);
    hn::StoreU(hn::DemoteTo(kBytes, colour), kBytes, index + x);
  }
  return x;
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Bins);
HWY_EXPORT(PairColours);

uint16_t colour_bin(uint8_t blue, uint8_t green, uint8_t red, ColourBins bins) {
  const BinSplit split = split_of(bins);
  const Hsv c(blue, green, red);
  const int s = c.high == 0 ? 0 : std::min(split.saturation - 1, split.saturation * c.spread / c.high);
  const int v = split.value * c.high / 256;
  return static_cast<uint16_t>((c.hue_part(split.hue) * split.saturation + s) * split.value + v);
}

void colour_bins(const uint8_t* bgr, size_t count, ColourBins bins, uint16_t* index) {
  const size_t done = HWY_DYNAMIC_DISPATCH(Bins)(bgr, count, split_of(bins), index);
  for (size_t i = done; i < count; ++i) index[i] = colour_bin(bgr[3 * i], bgr[3 * i + 1], bgr[3 * i + 2], bins);
}

void pair_colours(const uint8_t* bgr, size_t count, int colours, uint8_t* index) {
  const size_t done = HWY_DYNAMIC_DISPATCH(PairColours)(bgr, count, pair_split_of(colours), index);
  for (size_t i = done; i < count; ++i) index[i] = pair_colour(bgr[3 * i], bgr[3 * i + 1], bgr[3 * i + 2], colours);
}

}  // namespace takt::object_detection
#endif
