// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/shrink.hpp"

#include <algorithm>
#include <cmath>

namespace takt::object_detection {

Shrinker::Shrinker(int width, int height, double scale) : columns_(taps(width, scale)), rows_(taps(height, scale)) {
  row_.resize(3 * static_cast<size_t>(width));
  pixels_.resize(3 * columns_.size() * rows_.size());
}

std::vector<Shrinker::Tap> Shrinker::taps(int from, double scale) {
  std::vector<Tap> taps(static_cast<size_t>(std::max(1l, std::lround(scale * from))));
  const double ratio = 1.0 / (static_cast<double>(taps.size()) / from);  // in these two steps, as OpenCV does
  for (size_t i = 0; i < taps.size(); ++i) {
    const double position = ratio * (static_cast<double>(i) + 0.5) - 0.5, below = std::floor(position);
    const int first = std::clamp(static_cast<int>(below), 0, from - 1);
    taps[i] = {first, std::min(first + 1, from - 1), 0};
    if (below >= 0 && first < from - 1) taps[i].share = static_cast<uint32_t>(std::nearbyint((position - below) * 256));
  }
  return taps;
}

/// Rows first: that is done for many pixels at once, and the sums are the same in either order.
ImageView<const uint8_t> Shrinker::run(ImageView<const uint8_t> bgr) {
  uint8_t* out = pixels_.data();
  for (const Tap& y : rows_) {
    const uint8_t *upper = bgr.row(y.first), *lower = bgr.row(y.second);
    for (size_t i = 0; i < row_.size(); ++i)
      row_[i] = static_cast<uint16_t>((256 - y.share) * upper[i] + y.share * lower[i]);
    for (const Tap& x : columns_) {
      const uint16_t *left = row_.data() + ptrdiff_t{3} * x.first, *right = row_.data() + ptrdiff_t{3} * x.second;
      for (int c = 0; c < 3; ++c)
        *out++ = static_cast<uint8_t>(((256 - x.share) * left[c] + x.share * right[c] + 0x8000) >> 16);
    }
  }
  return {pixels_.data(), width(), height(), 3};
}

}  // namespace takt::object_detection
