// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/texture.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {

ReferenceArea::ReferenceArea(int width, int height, const TrapezoidShares& shares) : width_(width), height_(height) {
  spans_.reserve(static_cast<size_t>(height));
  tune(shares);
}

void ReferenceArea::tune(const TrapezoidShares& shares) {
  const double bottom_row = height_ * (1 - shares.skip), top_row = bottom_row - height_ * shares.height;
  const int first = std::clamp(static_cast<int>(std::lround(top_row)), 0, height_);
  const int last = std::clamp(static_cast<int>(std::lround(bottom_row)), first, height_);
  spans_.clear();
  pixels_ = 0;
  for (int y = first; y < last; ++y) {
    const double down = (y + 0.5 - first) / (last - first);
    const double half = 0.5 * width_ * (shares.top + (shares.bottom - shares.top) * down), middle = 0.5 * width_;
    const RowSpan span{y, std::max(0, static_cast<int>(std::lround(middle - half))),
                       std::min(width_, static_cast<int>(std::lround(middle + half)))};
    spans_.push_back(span);
    pixels_ += std::max(0, span.last - span.first);
  }
}

bool ReferenceArea::contains(double x_px, double y_px) const {
  if (spans_.empty()) return false;
  const double row = std::floor(y_px + 0.5) - spans_.front().y;
  if (!(row >= 0 && row < static_cast<double>(spans_.size()))) return false;
  const RowSpan& span = spans_[static_cast<size_t>(row)];
  return x_px >= span.first - 0.5 && x_px < span.last - 0.5;
}

namespace {

using Histogram = std::array<int64_t, 256>;

struct Extent {
  uint8_t low, high;
};

std::optional<Extent> extent(const Histogram& histogram, double needed) {
  const auto kept = [&](int64_t count) { return count > 0 && static_cast<double>(count) >= needed; };
  const auto low = std::find_if(histogram.begin(), histogram.end(), kept);
  if (low == histogram.end()) return std::nullopt;
  const auto high = std::find_if(histogram.rbegin(), histogram.rend(), kept);
  return Extent{static_cast<uint8_t>(low - histogram.begin()), static_cast<uint8_t>(histogram.rend() - high - 1)};
}

}  // namespace

std::optional<Descriptor> describe(ImageView<const uint8_t> saturation, ImageView<const uint8_t> value,
                                   const ReferenceArea& area, double t_m) {
  Histogram s{}, v{};
  for (const RowSpan& span : area.spans()) {
    const uint8_t *s_row = saturation.row(span.y), *v_row = value.row(span.y);
    for (int x = span.first; x < span.last; ++x) ++s[s_row[x]], ++v[v_row[x]];
  }
  const double needed = t_m * static_cast<double>(area.pixels()) / static_cast<double>(kDefaultAreaPx);
  const auto s_extent = extent(s, needed), v_extent = extent(v, needed);
  if (!s_extent || !v_extent) return std::nullopt;
  return Descriptor{s_extent->low, s_extent->high, v_extent->low, v_extent->high};
}

TextureMemory::TextureMemory(int capacity, double t_w)
    : ring_(static_cast<size_t>(capacity)), sums_(kStride * kStride), table_(256 * 256) {
  tune(t_w);
}

// An integer is above t_w N_b exactly if it is above the integer part of it; 0.9 * 500 may be a bit off 450.
void TextureMemory::tune(double t_w) {
  limit_ = static_cast<int32_t>(std::min(std::floor(t_w * static_cast<double>(ring_.size()) + 1e-9), 1e9));
  rebuild();
}

int TextureMemory::weight(int k) const {
  const int capacity = static_cast<int>(ring_.size());
  if (filled_ < capacity && k >= filled_) return 0;
  const int age = (newest_ - k + capacity) % capacity;
  return capacity - age;
}

void TextureMemory::add(const Descriptor& descriptor) {
  const int capacity = static_cast<int>(ring_.size());
  newest_ = (newest_ + 1) % capacity;
  filled_ = std::min(filled_ + 1, capacity);
  ring_[static_cast<size_t>(newest_)] = descriptor;
  rebuild();
}

// Every rectangle of weight w is four corners of a difference image; its two-dimensional prefix sum holds at each
// (s, v) the weights of all rectangles around it.
void TextureMemory::rebuild() {
  std::fill(sums_.begin(), sums_.end(), 0);
  const auto corner = [&](int s, int v) -> int32_t& {
    return sums_[(static_cast<size_t>(v) + 1) * kStride + static_cast<size_t>(s) + 1];
  };
  for (int k = 0; k < filled_; ++k) {
    const Descriptor& d = ring_[static_cast<size_t>(k)];
    const int32_t w = weight(k);
    corner(d.s_min, d.v_min) += w;
    corner(d.s_max + 1, d.v_min) -= w;
    corner(d.s_min, d.v_max + 1) -= w;
    corner(d.s_max + 1, d.v_max + 1) += w;
  }
  for (size_t v = 1; v <= 256; ++v) {
    int32_t *row = sums_.data() + v * kStride, along = 0;
    const int32_t* above = row - kStride;
    uint8_t* out = table_.data() + (v - 1) * 256;
    for (size_t s = 1; s <= 256; ++s) {
      along += row[s];
      row[s] = along + above[s];
      out[s - 1] = row[s] > limit_;
    }
  }
}

}  // namespace takt::ground_map
