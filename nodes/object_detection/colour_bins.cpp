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

// Quotients of integers n / d with n < 2^17 and d < 2^11 stay at least 2^-11 below the next integer unless they are
// one, farther than a float rounds: truncation gives the floor exactly.
size_t Bins(const uint8_t* bgr, size_t count, BinSplit split, uint16_t* index) {
  const hn::ScalableTag<float> f;
  const hn::Rebind<int32_t, decltype(f)> i32;
  const hn::Rebind<uint16_t, decltype(f)> u16;
  const hn::Rebind<uint8_t, decltype(f)> u8;
  const size_t lanes = hn::Lanes(f);
  const auto one = hn::Set(f, 1.0f), two = hn::Set(f, 2.0f), four = hn::Set(f, 4.0f), six = hn::Set(f, 6.0f);
  const auto hues = hn::Set(f, static_cast<float>(split.hue)),
             saturations = hn::Set(f, static_cast<float>(split.saturation));
  const auto last_saturation = hn::Set(i32, split.saturation - 1), hue_step = hn::Set(i32, split.saturation);
  const auto values = hn::Set(i32, split.value);
  size_t x = 0;
  for (; x + lanes <= count; x += lanes) {
    hn::Vec<decltype(u8)> b8, g8, r8;
    hn::LoadInterleaved3(u8, bgr + 3 * x, b8, g8, r8);
    const auto b = hn::ConvertTo(f, hn::PromoteTo(i32, b8)), g = hn::ConvertTo(f, hn::PromoteTo(i32, g8)),
               r = hn::ConvertTo(f, hn::PromoteTo(i32, r8));
    const auto high = hn::Max(b, hn::Max(g, r)), spread = hn::Sub(high, hn::Min(b, hn::Min(g, r)));
    const auto of_red = hn::Sub(g, b), of_green = hn::Add(hn::Mul(two, spread), hn::Sub(b, r)),
               of_blue = hn::Add(hn::Mul(four, spread), hn::Sub(r, g));
    auto hue = hn::IfThenElse(hn::Eq(high, r), of_red, hn::IfThenElse(hn::Eq(high, g), of_green, of_blue));
    hue = hn::Add(hue, hn::IfThenElseZero(hn::Lt(hue, hn::Zero(f)), hn::Mul(six, spread)));
    const auto h = hn::ConvertTo(i32, hn::Div(hn::Mul(hue, hues), hn::Mul(six, hn::Max(spread, one))));
    const auto s =
        hn::Min(last_saturation, hn::ConvertTo(i32, hn::Div(hn::Mul(spread, saturations), hn::Max(high, one))));
    const auto v = hn::ShiftRight<8>(hn::Mul(hn::ConvertTo(i32, high), values));
    const auto bin = hn::Add(hn::Mul(hn::Add(hn::Mul(h, hue_step), s), values), v);
    hn::StoreU(hn::DemoteTo(u16, bin), u16, index + x);
  }
  return x;
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Bins);

uint16_t colour_bin(uint8_t blue, uint8_t green, uint8_t red, ColourBins bins) {
  const BinSplit split = split_of(bins);
  const int b = blue, g = green, r = red;
  const int high = std::max({b, g, r}), spread = high - std::min({b, g, r});
  // hue / spread is the position on the colour circle in sixths of a turn
  int hue = high == r ? g - b : high == g ? 2 * spread + b - r : 4 * spread + r - g;
  if (hue < 0) hue += 6 * spread;
  const int h = spread == 0 ? 0 : split.hue * hue / (6 * spread);
  const int s = high == 0 ? 0 : std::min(split.saturation - 1, split.saturation * spread / high);
  const int v = split.value * high / 256;
  return static_cast<uint16_t>((h * split.saturation + s) * split.value + v);
}

void colour_bins(const uint8_t* bgr, size_t count, ColourBins bins, uint16_t* index) {
  const size_t done = HWY_DYNAMIC_DISPATCH(Bins)(bgr, count, split_of(bins), index);
  for (size_t i = done; i < count; ++i) index[i] = colour_bin(bgr[3 * i], bgr[3 * i + 1], bgr[3 * i + 2], bins);
}

}  // namespace takt::object_detection
#endif
