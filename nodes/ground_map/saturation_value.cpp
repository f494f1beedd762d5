// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/saturation_value.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ground_map/saturation_value.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ground_map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The integer quotient (510 d + m) / (2 m) by a division in float: numerator and denominator are exact there, and below
// an integer the quotient keeps a distance of at least 1 / 510, far above the spacing of floats up to 256. So cutting
// off the fraction gives the integer division.
void SaturationValueRow(const uint8_t* bgr, int count, uint8_t* saturation, uint8_t* value) {
  const hn::ScalableTag<float> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<uint8_t, decltype(df)> d8_part;
  const hn::ScalableTag<uint8_t> d8;
  const int lanes = static_cast<int>(hn::Lanes(d8)), part = static_cast<int>(hn::Lanes(df));
  HWY_ALIGN uint8_t spread[HWY_MAX_BYTES];
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::Vec<decltype(d8)> b, g, r;
    hn::LoadInterleaved3(d8, bgr + 3 * i, b, g, r);
    const auto high = hn::Max(hn::Max(b, g), r);
    hn::Store(hn::Sub(high, hn::Min(hn::Min(b, g), r)), d8, spread);
    hn::StoreU(high, d8, value + i);
    for (int k = 0; k < lanes; k += part) {
      const auto difference = hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(d8_part, spread + k)));
      const auto most = hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(d8_part, value + i + k)));
      const auto numerator = hn::Add(hn::Mul(difference, hn::Set(df, 510.0f)), most);
      const auto denominator = hn::Max(hn::Add(most, most), hn::Set(df, 1.0f));  // black: 0 / 1
      const auto quotient = hn::ConvertTo(di, hn::Div(numerator, denominator));  // towards zero
      hn::StoreU(hn::DemoteTo(d8_part, quotient), d8_part, saturation + i + k);
    }
  }
  for (; i < count; ++i) {
    const SaturationValue p = saturation_value(bgr[3 * i], bgr[3 * i + 1], bgr[3 * i + 2]);
    saturation[i] = p.saturation;
    value[i] = p.value;
  }
}

}  // namespace takt::ground_map::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ground_map {

HWY_EXPORT(SaturationValueRow);

void saturation_value_row(const uint8_t* bgr, int count, uint8_t* saturation, uint8_t* value) {
  HWY_DYNAMIC_DISPATCH(SaturationValueRow)(bgr, count, saturation, value);
}

}  // namespace takt::ground_map
#endif
