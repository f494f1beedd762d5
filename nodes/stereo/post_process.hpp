// SPDX-License-Identifier: Apache-2.0
// Internal: what all matchers do with the winners. A fine disparity is a disparity and its fraction in one number,
// disparity << 6 | fraction.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Whether the views are those of a matcher for that size.
inline bool fit(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out, int width,
                int height, int channels) {
  const auto is = [&](const auto& view, int wanted) {
    return view.width == width && view.height == height && view.channels == wanted && view.data != nullptr;
  };
  return is(left, channels) && is(right, channels) && is(out.disparity, 1) && is(out.confidence, 1) &&
         (out.fraction.data == nullptr || is(out.fraction, 1));
}

/// Median of 3 x 3 fine disparities, the border replicated. `in` has one readable element beside each row.
void median_3x3(ImageView<int16_t> in, ImageView<int16_t> out);

/// Fine disparities where there is one; `fraction` may be null.
inline void take_fine(const int16_t* fine, int count, int16_t* disparity, uint8_t* fraction) {
  for (int i = 0; i < count; ++i)
    disparity[i] = disparity[i] < 0 ? disparity[i] : static_cast<int16_t>(fine[i] / kFractions);
  if (fraction == nullptr) return;
  for (int i = 0; i < count; ++i) fraction[i] = static_cast<uint8_t>(fine[i] % kFractions);
}

/// Left-right check of one row: -1 where the right image's own disparity differs by over 1 px or is outside.
template <class DisparityOfRight>
void reject_inconsistent(int16_t* disparity, int count, DisparityOfRight of_right) {
  for (int x = 0; x < count; ++x) {
    const int d = disparity[x], xr = x - d;
    if (d >= 0 && (xr < 0 || std::abs(of_right(xr) - d) > 1)) disparity[x] = -1;
  }
}

}  // namespace takt::stereo
