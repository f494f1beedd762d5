// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/layout.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/object_detection/colour_bins.hpp"

namespace takt::object_detection {

int16_t layout_feature(uint32_t count, int cell_pixels) {
  const float share = static_cast<float>(count) / static_cast<float>(cell_pixels);
  return static_cast<int16_t>(255 * std::sqrt(share) + 0.5f);
}

LayoutSums::LayoutSums(int most_width, int most_height)
    : orientations_(2 * kLayoutOrientations), colours_(static_cast<size_t>(most_width)) {
  const auto width = static_cast<size_t>(most_width), height = static_cast<size_t>(most_height);
  values_.resize(OrientationBins::kValueRows * (width + 2));  // one pixel more on each side
  index_.resize((width + 2) * height);
  sums_.resize((width + 1) * (height + 1));
}

void LayoutSums::take(ImageView<const uint8_t> bgr, int x0, int y0, int width, int height) {
  x0_ = x0;
  y0_ = y0;
  stride_ = static_cast<size_t>(width) + 1;
  const int left = std::max(0, x0 - 1), top = std::max(0, y0 - 1);
  const int right = std::min(bgr.width, x0 + width + 1), bottom = std::min(bgr.height, y0 + height + 1);
  const ImageView<const uint8_t> around(&bgr.at(left, top), right - left, bottom - top, 3, bgr.stride);
  orientations_.rows(around, y0 - top, y0 - top + height, values_.data(), index_.data());
  std::fill_n(sums_.begin(), stride_, Counts{});
  for (int y = 0; y < height; ++y) {
    pair_colours(&bgr.at(x0, y0 + y), static_cast<size_t>(width), kLayoutColours, colours_.data());
    const uint16_t* orientation = index_.data() + ptrdiff_t{y} * around.width + (x0 - left);
    const Counts* above = sums_.data() + static_cast<size_t>(y) * stride_;
    Counts *own = sums_.data() + static_cast<size_t>(y + 1) * stride_, in_row{};
    own[0] = {};
    for (int x = 0; x < width; ++x) {
      ++in_row[colours_[static_cast<size_t>(x)]];
      if (orientation[x] != orientations_.none())
        ++in_row[static_cast<size_t>(kLayoutColours + orientation[x] % kLayoutOrientations)];
      for (size_t bin = 0; bin < kLayoutBins; ++bin)
        own[x + 1][bin] = static_cast<uint16_t>(above[x + 1][bin] + in_row[bin]);
    }
  }
}

void LayoutSums::features(const Placement& at, LayoutFeatures& out) const {
  int16_t* feature = out.data();
  for (int v = 0; v < kLayoutCells; ++v) {
    const int top = at.y + layout_edge(v, at.side), bottom = at.y + layout_edge(v + 1, at.side);
    for (int u = 0; u < kLayoutCells; ++u) {
      const int left = at.x + layout_edge(u, at.side), right = at.x + layout_edge(u + 1, at.side);
      const Counts &a = sum(left, top), &b = sum(right, top), &c = sum(left, bottom), &d = sum(right, bottom);
      const int pixels = (right - left) * (bottom - top);
      for (size_t bin = 0; bin < kLayoutBins; ++bin)
        *feature++ = layout_feature(static_cast<uint16_t>(d[bin] - c[bin] - b[bin] + a[bin]), pixels);
    }
  }
}

}  // namespace takt::object_detection
