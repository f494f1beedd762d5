// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/saddle_kernel.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/person_tracking/saddle_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::person_tracking::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::CappedTag<int16_t, kRowSlack / 2>;
constexpr Words kWords;
constexpr hn::Rebind<uint8_t, Words> kBytes;

void SaddleRow(const uint8_t* middle, ptrdiff_t stride, int width, int16_t* out) {
  const auto step = static_cast<int>(hn::Lanes(kWords));
  for (int x = kRingRadius; x < width - kRingRadius; x += step) {
    const auto at = [&](int dx, int dy)
                        HWY_ATTR { return hn::PromoteTo(kWords, hn::LoadU(kBytes, middle + dy * stride + x + dx)); };
    const auto ring = [&](size_t n) HWY_ATTR { return at(kRing[n].x, kRing[n].y); };
    auto saddle = hn::Zero(kWords), line = saddle, sum = saddle;
    for (size_t n = 0; n < 4; ++n) {
      const auto a = ring(n), b = ring(n + 4), c = ring(n + 8), d = ring(n + 12);
      const auto along = hn::Add(a, c), across = hn::Add(b, d);
      saddle = hn::Add(saddle, hn::Abs(hn::Sub(along, across)));
      line = hn::Add(line, hn::Add(hn::Abs(hn::Sub(a, c)), hn::Abs(hn::Sub(b, d))));
      sum = hn::Add(sum, hn::Add(along, across));
    }
    const auto beside = hn::Add(hn::Add(at(-1, 0), at(1, 0)), hn::Add(at(0, -1), at(0, 1)));
    const auto off = hn::Abs(hn::Sub(sum, hn::ShiftLeft<2>(beside)));
    hn::StoreU(hn::Max(hn::Sub(hn::Sub(saddle, line), off), hn::Zero(kWords)), kWords, out + x);
  }
}

void GreyRow(const uint8_t* bgr, int count, uint8_t* out) {
  const auto step = static_cast<int>(hn::Lanes(kBytes));
  int x = 0;
  for (; x + step <= count; x += step) {
    hn::Vec<decltype(kBytes)> b, g, r;
    hn::LoadInterleaved3(kBytes, bgr + 3 * x, b, g, r);
    const auto wide = [&](auto v) HWY_ATTR { return hn::PromoteTo(kWords, v); };
    const auto sum = hn::Add(hn::Add(wide(b), wide(r)), hn::Add(hn::ShiftLeft<1>(wide(g)), hn::Set(kWords, 2)));
    hn::StoreU(hn::DemoteTo(kBytes, hn::ShiftRight<2>(sum)), kBytes, out + x);
  }
  for (; x < count; ++x) out[x] = static_cast<uint8_t>((bgr[3 * x] + 2 * bgr[3 * x + 1] + bgr[3 * x + 2] + 2) >> 2);
}

}  // namespace takt::person_tracking::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::person_tracking {

HWY_EXPORT(SaddleRow);
HWY_EXPORT(GreyRow);

void saddle_row(ImageView<const uint8_t> grey, int y, int16_t* out) {
  HWY_DYNAMIC_DISPATCH(SaddleRow)(grey.row(y), grey.stride, grey.width, out);
  // What the last vector made of pixels beside the row.
  std::fill_n(out, std::min(kRingRadius, grey.width), int16_t{0});
  std::fill_n(out + std::max(0, grey.width - kRingRadius), kRingRadius + kRowSlack / 2, int16_t{0});
}

void grey_row(const uint8_t* bgr, int count, uint8_t* out) { HWY_DYNAMIC_DISPATCH(GreyRow)(bgr, count, out); }

}  // namespace takt::person_tracking
#endif
