// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/orientation_bins.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

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

/// Pixels 1 .. x - 1 of the row; returns x.
size_t Row(const uint8_t* above, const uint8_t* own, const uint8_t* below, size_t width, const int32_t* borders,
           int count, uint16_t* index) {
  const hn::ScalableTag<int32_t> d;
  const hn::RebindToFloat<decltype(d)> f;
  const hn::Rebind<uint8_t, decltype(d)> u8;
  const hn::Rebind<uint16_t, decltype(d)> u16;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1), half = hn::Set(d, count / 2), quarter = hn::Set(d, count / 4),
             low = hn::Set(d, 0xFFFF), none = hn::Set(d, count),
             shortest2 = hn::Set(d, OrientationBins::kShortest * OrientationBins::kShortest);
  const auto bins = hn::Set(f, static_cast<float>(count / 4)), linear = hn::Set(f, 0.6738f),
             square = hn::Set(f, 0.1738f), rounding = hn::Set(f, 0.5f);
  const auto value = [&](const uint8_t* at) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(u8, at)); };
  size_t x = 1;
  for (; x + hn::Lanes(d) < width; x += hn::Lanes(d)) {
    const auto ul = value(above + x - 1), u = value(above + x), ur = value(above + x + 1), l = value(own + x - 1),
               r = value(own + x + 1), dl = value(below + x - 1), b = value(below + x), dr = value(below + x + 1);
    const auto down = hn::Sub(dr, ul), up = hn::Sub(ur, dl);  // along the two diagonals
    const auto gx = hn::Add(hn::Add(down, up), hn::ShiftLeft<1>(hn::Sub(r, l))),
               gy = hn::Add(hn::Sub(down, up), hn::ShiftLeft<1>(hn::Sub(b, u)));
    // Turned by whole quarters into the first one: first > 0 and second >= 0 unless the gradient is zero.
    const auto right = hn::Gt(gx, zero), left = hn::Lt(gx, zero), downward = hn::Gt(gy, zero),
               upward = hn::Lt(gy, zero);
    const auto odd = hn::Or(hn::AndNot(right, downward), hn::AndNot(left, upward));
    const auto second_half = hn::Or(upward, hn::AndNot(downward, left));
    const auto ax = hn::Abs(gx), ay = hn::Abs(gy);
    const auto first = hn::IfThenElse(odd, ay, ax), second = hn::IfThenElse(odd, ax, ay);
    // atan(t) / (pi / 2) = 0.6738 t - 0.1738 t^2 for t in 0..1, within 0.25 degrees: less than half a bin
    const auto t = hn::Div(hn::ConvertTo(f, hn::Min(ax, ay)), hn::ConvertTo(f, hn::Max(one, hn::Max(ax, ay))));
    const auto part = hn::Mul(t, hn::Sub(linear, hn::Mul(square, t)));
    const auto steep = hn::RebindMask(f, hn::Gt(second, first));
    const auto turn = hn::IfThenElse(steep, hn::Sub(hn::Set(f, 1.0f), part), part);
    const auto near = hn::ConvertTo(d, hn::Add(hn::Mul(turn, bins), rounding));
    const auto border = hn::GatherIndex(d, borders, near);
    const auto before = hn::Lt(hn::Mul(second, hn::And(border, low)), hn::Mul(first, hn::ShiftRight<16>(border)));
    auto bin = hn::Sub(near, hn::IfThenElseZero(before, one));
    bin = hn::Add(bin, hn::Add(hn::IfThenElseZero(odd, quarter), hn::IfThenElseZero(second_half, half)));
    const auto is_short = hn::Lt(hn::Add(hn::Mul(gx, gx), hn::Mul(gy, gy)), shortest2);
    hn::StoreU(hn::DemoteTo(u16, hn::IfThenElse(is_short, none, bin)), u16, index + x);
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
  const int borders = count / 4;
  borders_.push_back(1);
  for (int i = 1; i < borders; ++i) {
    const double slope = std::tan(2 * std::numbers::pi * i / count);
    int64_t p = kLargest, q = 1;
    for (int at_q = 1; at_q <= kLargest; ++at_q) {
      // A whole-number gradient lies on a border only at 45 degrees, where the slope is 1 but for rounding.
      const auto at_p = static_cast<int64_t>(std::ceil(slope * at_q - 1e-9));
      if (at_p <= kLargest && at_p * q < p * at_q) p = at_p, q = at_q;
    }
    borders_.push_back(static_cast<int32_t>(p << 16 | q));
  }
  borders_.push_back(1 << 16);
}

uint16_t OrientationBins::of(int gx, int gy) const {
  if (gx * gx + gy * gy < kShortest * kShortest) return none();
  int quarters = 0;
  for (; gx <= 0 || gy < 0; ++quarters) gx = std::exchange(gy, -gx);
  const auto reached = [&](int32_t border) { return gy * (border & 0xFFFF) >= gx * (border >> 16); };
  const auto beyond = std::partition_point(borders_.begin(), borders_.end(), reached);
  return static_cast<uint16_t>(quarters * (count_ / 4) + (beyond - borders_.begin()) - 1);
}

void OrientationBins::values(const uint8_t* bgr, size_t width, uint8_t* value) {
  for (size_t x = HWY_DYNAMIC_DISPATCH(Values)(bgr, width, value); x < width; ++x)
    value[x] = std::max({bgr[3 * x], bgr[3 * x + 1], bgr[3 * x + 2]});
}

void OrientationBins::row(const uint8_t* above, const uint8_t* own, const uint8_t* below, size_t width,
                          uint16_t* index) const {
  size_t x = HWY_DYNAMIC_DISPATCH(Row)(above, own, below, width, borders_.data(), count_, index);
  for (; x + 1 < width; ++x) {
    const int down = below[x + 1] - above[x - 1], up = above[x + 1] - below[x - 1];
    index[x] = of(down + up + 2 * (own[x + 1] - own[x - 1]), down - up + 2 * (below[x] - above[x]));
  }
  index[0] = index[width - 1] = none();
}

void OrientationBins::image(ImageView<const uint8_t> bgr, uint8_t* values, uint16_t* index) const {
  const auto width = static_cast<size_t>(bgr.width);
  for (int y = 0; y < bgr.height; ++y) {
    this->values(bgr.row(y), width, values + static_cast<size_t>(y) * width);
    uint16_t* out = index + static_cast<size_t>(y) * width;
    if (y == 0 || y == bgr.height - 1) std::fill_n(out, width, none());
    if (y < 2) continue;
    const uint8_t* own = values + static_cast<size_t>(y - 1) * width;
    row(own - width, own, own + width, width, out - width);
  }
}

}  // namespace takt::object_detection
#endif
