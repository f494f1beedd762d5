// SPDX-License-Identifier: Apache-2.0
// Saturation and value of HSV (thesis Sec. 4.2.1); the hue is not used by the ground test.
#pragma once
#include <cstdint>

namespace takt::ground_map {

/// value = max(b, g, r); saturation = 255 (max - min) / max rounded half up, 0 for black. The slow obvious form.
struct SaturationValue {
  uint8_t saturation, value;
};
constexpr SaturationValue saturation_value(uint8_t b, uint8_t g, uint8_t r) {
  const int high = b > g ? (b > r ? b : r) : (g > r ? g : r), low = b < g ? (b < r ? b : r) : (g < r ? g : r);
  if (high == 0) return {0, 0};
  return {static_cast<uint8_t>((510 * (high - low) + high) / (2 * high)), static_cast<uint8_t>(high)};
}

/// The same for `count` interleaved BGR pixels, vectorised; every SIMD target gives the same bytes. The outputs have
/// `count` elements; nothing beyond is read or written.
void saturation_value_row(const uint8_t* bgr, int count, uint8_t* saturation, uint8_t* value);

}  // namespace takt::ground_map
