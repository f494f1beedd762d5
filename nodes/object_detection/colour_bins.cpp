// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/colour_bins.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/colour_bins.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::Rebind<int32_t, decltype(kFloats)> kInts;
constexpr hn::Rebind<uint16_t, decltype(kFloats)> kShorts;
constexpr hn::Rebind<uint8_t, decltype(kFloats)> kBytes;
using Floats = hn::Vec<decltype(kFloats)>;
using Ints = hn::Vec<decltype(kInts)>;

/// Whole numbers: hue / spread is the position on the colour circle in sixths of a turn, spread / high the saturation.
struct Hsv {
  Floats hue, spread, high;

  HWY_INLINE explicit Hsv(const uint8_t* bgr) {
    hn::Vec<decltype(kBytes)> b8, g8, r8;
    hn::LoadInterleaved3(kBytes, bgr, b8, g8, r8);
    const auto b = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, b8)),
               g = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, g8)),
               r = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, r8));
    high = hn::Max(b, hn::Max(g, r));
    spread = hn::Sub(high, hn::Min(b, hn::Min(g, r)));
    const auto of_red = hn::Sub(g, b), of_green = hn::Add(hn::Add(spread, spread), hn::Sub(b, r)),
               of_blue = hn::Add(hn::Mul(hn::Set(kFloats, 4.0f), spread), hn::Sub(r, g));
    hue = hn::IfThenElse(hn::Eq(high, r), of_red, hn::IfThenElse(hn::Eq(high, g), of_green, of_blue));
    hue = hn::Add(hue, hn::IfThenElseZero(hn::Lt(hue, hn::Zero(kFloats)), hn::Mul(hn::Set(kFloats, 6.0f), spread)));
  }
  /// floor(`parts` hue / turn). Quotients of integers n / d with n < 2^17 and d < 2^11 stay at least 2^-11 below the
  /// next integer unless they are one, farther than a float rounds: truncation gives the floor exactly.
  HWY_INLINE Ints hue_part(Floats parts) const {
    const auto one = hn::Set(kFloats, 1.0f), six = hn::Set(kFloats, 6.0f);
    return hn::ConvertTo(kInts, hn::Div(hn::Mul(hue, parts), hn::Mul(six, hn::Max(spread, one))));
  }
};

size_t Bins(const uint8_t* bgr, size_t count, BinSplit split, uint16_t* index) {
  const auto one = hn::Set(kFloats, 1.0f);
  const auto hues = hn::Set(kFloats, static_cast<float>(split.hue)),
             saturations = hn::Set(kFloats, static_cast<float>(split.saturation));
  const auto last_saturation = hn::Set(kInts, split.saturation - 1), hue_step = hn::Set(kInts, split.saturation);
  const auto values = hn::Set(kInts, split.value);
  size_t x = 0;
  for (; x + hn::Lanes(kFloats) <= count; x += hn::Lanes(kFloats)) {
    const Hsv c(bgr + 3 * x);
    const auto s =
        hn::Min(last_saturation, hn::ConvertTo(kInts, hn::Div(hn::Mul(c.spread, saturations), hn::Max(c.high, one))));
    const auto v = hn::ShiftRight<8>(hn::Mul(hn::ConvertTo(kInts, c.high), values));
    const auto bin = hn::Add(hn::Mul(hn::Add(hn::Mul(c.hue_part(hues), hue_step), s), values), v);
    hn::StoreU(hn::DemoteTo(kShorts, bin), kShorts, index + x);
  }
  return x;
}

size_t PairColours(const uint8_t* bgr, size_t count, PairColourSplit split, uint8_t* index) {
  const auto number = [](int value) HWY_ATTR { return hn::Set(kFloats, static_cast<float>(value)); };
  const auto black_below = number(split.black_below), grey_below = number(split.grey_below),
             mid_from = number(split.mid_from), bright_from = number(split.bright_from), hues = number(split.hues),
             twenty = number(20);
  const auto one = hn::Set(kInts, 1), first_hue = hn::Set(kInts, split.first_hue);
  size_t x = 0;
  for (; x + hn::Lanes(kFloats) <= count; x += hn::Lanes(kFloats)) {
    const Hsv c(bgr + 3 * x);
    const auto at_least = [&](Floats from)
                              HWY_ATTR { return hn::IfThenElseZero(hn::RebindMask(kInts, hn::Ge(c.high, from)), one); };
    const auto grey = hn::Add(one, hn::Add(at_least(mid_from), at_least(bright_from)));
    const auto is_grey = hn::Lt(hn::Mul(twenty, c.spread), hn::Mul(grey_below, c.high));
    auto colour = hn::IfThenElse(hn::RebindMask(kInts, is_grey), grey, hn::Add(first_hue, c.hue_part(hues)));
    colour = hn::IfThenElseZero(hn::RebindMask(kInts, hn::Ge(c.high, black_below)), colour);
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

namespace {

/// As Hsv.
struct Colour {
  int hue, spread, high;

  Colour(int b, int g, int r) {
    high = std::max({b, g, r});
    spread = high - std::min({b, g, r});
    hue = high == r ? g - b : high == g ? 2 * spread + b - r : 4 * spread + r - g;
    if (hue < 0) hue += 6 * spread;
  }
  int hue_part(int parts) const { return spread == 0 ? 0 : parts * hue / (6 * spread); }
};

}  // namespace

uint16_t colour_bin(uint8_t blue, uint8_t green, uint8_t red, ColourBins bins) {
  const BinSplit split = split_of(bins);
  const Colour c(blue, green, red);
  const int s = c.high == 0 ? 0 : std::min(split.saturation - 1, split.saturation * c.spread / c.high);
  const int v = split.value * c.high / 256;
  return static_cast<uint16_t>((c.hue_part(split.hue) * split.saturation + s) * split.value + v);
}

uint8_t pair_colour(uint8_t blue, uint8_t green, uint8_t red, int colours) {
  const PairColourSplit split = pair_split_of(colours);
  const Colour c(blue, green, red);
  if (c.high < split.black_below) return 0;
  if (20 * c.spread < split.grey_below * c.high)
    return static_cast<uint8_t>(1 + (c.high >= split.mid_from) + (c.high >= split.bright_from));
  return static_cast<uint8_t>(split.first_hue + c.hue_part(split.hues));
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
