// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/corners.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "nodes/ego_motion/corner_kernel.hpp"

namespace takt::ego_motion {
namespace {

constexpr int kSmallestTile_px = 8;

float smaller_eigenvalue(float xx, float xy, float yy) {
  const float half_difference = 0.5f * (xx - yy);
  return 0.5f * (xx + yy) - std::sqrt(half_difference * half_difference + xy * xy);
}

}  // namespace

CornerDetector::CornerDetector(int width, int height, const CornerParameters& parameters)
    : width_(width), height_(height), p_(parameters), stride_(width + kRowPadding) {
  const auto columns = static_cast<size_t>(stride_);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  smooth_.resize(columns);
  step_.resize(columns);
  products_.resize(4 * 3 * columns);
  response_.resize(columns * static_cast<size_t>(height));
  peaks_.resize(columns);
  candidates_.reserve(pixels / 4 + 1);  // a 3 x 3 peak excludes its neighbours
  taken_.resize(pixels);
  in_tile_.reserve(tiles(std::min(kSmallestTile_px, p_.tile_px)));
  in_tile_.resize(tiles(p_.tile_px));
  corners_.reserve(static_cast<size_t>(p_.maximum));
}

size_t CornerDetector::tiles(int tile_px) const {
  return static_cast<size_t>((width_ + tile_px - 1) / tile_px) * static_cast<size_t>((height_ + tile_px - 1) / tile_px);
}

void CornerDetector::tune(const CornerParameters& parameters) {
  p_ = parameters;
  p_.maximum = std::min(p_.maximum, static_cast<int>(corners_.capacity()));
  in_tile_.resize(std::min(tiles(p_.tile_px), in_tile_.capacity()));
}

/// The largest response.
float CornerDetector::fill_response(const Plane& image) {
  const CornerKernels& kernels = corner_kernels();
  const auto gradient_row = [&](int i) {
    float* first = products_.data() + 3 * i * stride_;
    return GradientRow{first, first + stride_, first + 2 * stride_};
  };
  const GradientRow rows[3] = {gradient_row(0), gradient_row(1), gradient_row(2)}, sums = gradient_row(3);
  float largest = 0;
  for (int y = 1; y < height_ - 1; ++y) {
    kernels.gradients(image.row(y - 1), image.row(y), image.row(y + 1), width_, smooth_.data(), step_.data(),
                      rows[y % 3]);
    if (y >= 3) largest = kernels.response(rows, width_, sums, largest, response_.data() + (y - 1) * stride_);
  }
  return largest;
}

void CornerDetector::collect(float largest, ImageView<const int16_t> mask) {
  candidates_.clear();
  const float threshold = std::max(1.0f, static_cast<float>(p_.quality) * largest);
  const int margin = std::max(3, p_.margin_px);
  for (int y = margin; y < height_ - margin; ++y) {
    const float* row = response_.data() + y * stride_;
    const int count =
        corner_kernels().peaks(row - stride_, row, row + stride_, threshold, margin, width_ - margin, peaks_.data());
    for (int i = 0; i < count; ++i) {
      const int x = peaks_[static_cast<size_t>(i)];
      if (mask.data && mask.at(x, y) < 0) continue;
      if (candidates_.size() == candidates_.capacity()) return;  // only plateaus can fill it
      const auto index = static_cast<uint32_t>(y * width_ + x);
      candidates_.push_back(uint64_t{std::bit_cast<uint32_t>(row[x])} << 32 | ~index);
    }
  }
}

std::span<const Corner> CornerDetector::select() {
  corners_.clear();
  std::fill(taken_.begin(), taken_.end(), uint8_t{0});
  std::fill(in_tile_.begin(), in_tile_.end(), 0);
  const int tiles_x = (width_ + p_.tile_px - 1) / p_.tile_px;
  const int quota = std::max(1, 2 * p_.maximum / static_cast<int>(in_tile_.size()));
  // Most candidates are never looked at: order them in portions instead of all at once.
  auto sorted_to = candidates_.begin();
  for (auto it = candidates_.begin(); it != candidates_.end() && corners_.size() < static_cast<size_t>(p_.maximum);
       ++it) {
    if (it == sorted_to) {
      const auto portion = std::min<ptrdiff_t>(2 * p_.maximum, candidates_.end() - it);
      sorted_to = it + portion;
      if (sorted_to != candidates_.end()) std::nth_element(it, sorted_to, candidates_.end(), std::greater<>{});
      std::sort(it, sorted_to, std::greater<>{});
    }
    const auto index = static_cast<int>(~static_cast<uint32_t>(*it));
    const int x = index % width_, y = index / width_;
    int& count = in_tile_[static_cast<size_t>(y / p_.tile_px * tiles_x + x / p_.tile_px)];
    if (taken_[static_cast<size_t>(index)] || count >= quota) continue;
    ++count;
    corners_.push_back({static_cast<int16_t>(x), static_cast<int16_t>(y)});
    const int r = p_.distance_px - 1;
    const int left = std::max(0, x - r), right = std::min(width_ - 1, x + r);
    for (int v = std::max(0, y - r); v <= std::min(height_ - 1, y + r); ++v)
      std::fill_n(taken_.begin() + static_cast<ptrdiff_t>(v) * width_ + left, right - left + 1, uint8_t{1});
  }
  return corners_;
}

std::span<const Corner> CornerDetector::detect(const Plane& image, ImageView<const int16_t> mask) {
  collect(fill_response(image), mask);
  return select();
}

float CornerDetector::response_reference(const Plane& image, int x, int y) {
  float xx = 0, xy = 0, yy = 0;
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u) {
      const auto pixel = [&](int dx, int dy) { return static_cast<int>(image.row(v + dy)[u + dx]); };
      const int gx = pixel(1, -1) + 2 * pixel(1, 0) + pixel(1, 1) - pixel(-1, -1) - 2 * pixel(-1, 0) - pixel(-1, 1);
      const int gy = pixel(-1, 1) + 2 * pixel(0, 1) + pixel(1, 1) - pixel(-1, -1) - 2 * pixel(0, -1) - pixel(1, -1);
      xx += static_cast<float>(gx * gx);
      xy += static_cast<float>(gx * gy);
      yy += static_cast<float>(gy * gy);
    }
  return smaller_eigenvalue(xx, xy, yy);
}

std::vector<Corner> CornerDetector::select_reference(ImageView<const float> response, const CornerParameters& p,
                                                     ImageView<const int16_t> mask) {
  float largest = 0;
  for (int y = 0; y < response.height; ++y)
    for (int x = 0; x < response.width; ++x) largest = std::max(largest, response.at(x, y));
  const float threshold = std::max(1.0f, static_cast<float>(p.quality) * largest);
  const int margin = std::max(3, p.margin_px);
  std::vector<Corner> peaks, chosen;
  for (int y = margin; y < response.height - margin; ++y)
    for (int x = margin; x < response.width - margin; ++x) {
      bool peak = response.at(x, y) >= threshold && (!mask.data || mask.at(x, y) >= 0);
      for (int v = y - 1; v <= y + 1; ++v)
        for (int u = x - 1; u <= x + 1; ++u) peak &= response.at(x, y) >= response.at(u, v);
      if (peak) peaks.push_back({static_cast<int16_t>(x), static_cast<int16_t>(y)});
    }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [&](Corner a, Corner b) { return response.at(a.x, a.y) > response.at(b.x, b.y); });
  const auto tile = [&](Corner c) { return std::pair{c.x / p.tile_px, c.y / p.tile_px}; };
  const int tiles = ((response.width + p.tile_px - 1) / p.tile_px) * ((response.height + p.tile_px - 1) / p.tile_px);
  for (const Corner& c : peaks) {
    if (chosen.size() == static_cast<size_t>(p.maximum)) break;
    const auto near = [&](Corner o) { return std::max(std::abs(c.x - o.x), std::abs(c.y - o.y)) < p.distance_px; };
    const auto beside = std::count_if(chosen.begin(), chosen.end(), [&](Corner o) { return tile(o) == tile(c); });
    if (std::none_of(chosen.begin(), chosen.end(), near) && beside < std::max(1, 2 * p.maximum / tiles))
      chosen.push_back(c);
  }
  return chosen;
}

}  // namespace takt::ego_motion
