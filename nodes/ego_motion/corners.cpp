// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/corners.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace takt::ego_motion {
namespace {

float smaller_eigenvalue(float xx, float xy, float yy) {
  const float half_difference = 0.5f * (xx - yy);
  return 0.5f * (xx + yy) - std::sqrt(half_difference * half_difference + xy * xy);
}

}  // namespace

CornerDetector::CornerDetector(int width, int height, const CornerParameters& parameters)
    : width_(width), height_(height), p_(parameters) {
  const auto columns = static_cast<size_t>(width);
  const auto pixels = columns * static_cast<size_t>(height);
  for (int i = 0; i < 3; ++i) xx_[i].resize(columns), xy_[i].resize(columns), yy_[i].resize(columns);
  smooth_.resize(columns);
  step_.resize(columns);
  for (auto* line : {&sum_xx_, &sum_xy_, &sum_yy_, &peak_}) line->resize(columns);
  response_.resize(pixels);
  candidates_.reserve(pixels / 4 + 1);  // a 3 x 3 peak excludes its neighbours
  taken_.resize(pixels);
  const int tiles = ((width + p_.tile_px - 1) / p_.tile_px) * ((height + p_.tile_px - 1) / p_.tile_px);
  in_tile_.resize(static_cast<size_t>(tiles));
  corners_.reserve(static_cast<size_t>(p_.maximum));
}

void CornerDetector::gradient_row(const Plane& image, int y) {
  const uint8_t* a = image.row(y - 1);
  const uint8_t* b = image.row(y);
  const uint8_t* c = image.row(y + 1);
  // Separable Sobel: smoothed down the column for gx, differenced for gy; 16 bits hold both.
  int16_t* __restrict smooth = smooth_.data();
  int16_t* __restrict step = step_.data();
  for (int x = 0; x < width_; ++x) {
    smooth[x] = static_cast<int16_t>(a[x] + 2 * b[x] + c[x]);
    step[x] = static_cast<int16_t>(c[x] - a[x]);
  }
  float* __restrict xx = xx_[y % 3].data();
  float* __restrict xy = xy_[y % 3].data();
  float* __restrict yy = yy_[y % 3].data();
  for (int x = 1; x < width_ - 1; ++x) {
    const auto fx = static_cast<float>(static_cast<int16_t>(smooth[x + 1] - smooth[x - 1]));
    const auto fy = static_cast<float>(static_cast<int16_t>(step[x - 1] + 2 * step[x] + step[x + 1]));
    xx[x] = fx * fx;
    xy[x] = fx * fy;
    yy[x] = fy * fy;
  }
}

// Sums of squares of Sobel values stay below 2^24, so float sums are exact and their order does not matter.
void CornerDetector::response_row(int y) {
  float* __restrict sxx = sum_xx_.data();
  float* __restrict sxy = sum_xy_.data();
  float* __restrict syy = sum_yy_.data();
  for (int x = 1; x < width_ - 1; ++x) {
    sxx[x] = xx_[0][static_cast<size_t>(x)] + xx_[1][static_cast<size_t>(x)] + xx_[2][static_cast<size_t>(x)];
    sxy[x] = xy_[0][static_cast<size_t>(x)] + xy_[1][static_cast<size_t>(x)] + xy_[2][static_cast<size_t>(x)];
    syy[x] = yy_[0][static_cast<size_t>(x)] + yy_[1][static_cast<size_t>(x)] + yy_[2][static_cast<size_t>(x)];
  }
  float* __restrict out = response_.data() + static_cast<ptrdiff_t>(y) * width_;
  float largest = largest_;
  for (int x = 2; x < width_ - 2; ++x)
    out[x] = smaller_eigenvalue(sxx[x - 1] + sxx[x] + sxx[x + 1], sxy[x - 1] + sxy[x] + sxy[x + 1],
                                syy[x - 1] + syy[x] + syy[x + 1]);
  for (int x = 2; x < width_ - 2; ++x) largest = out[x] > largest ? out[x] : largest;
  largest_ = largest;
}

void CornerDetector::collect(ImageView<const int16_t> mask) {
  candidates_.clear();
  const float threshold = std::max(1.0f, static_cast<float>(p_.quality) * largest_);
  const int margin = std::max(3, p_.margin_px);
  for (int y = margin; y < height_ - margin; ++y) {
    const float* above = response_.data() + static_cast<ptrdiff_t>(y - 1) * width_;
    const float* here = above + width_;
    const float* below = here + width_;
    float* __restrict peak = peak_.data();
    for (int x = 0; x < width_; ++x) {
      const float m = above[x] > below[x] ? above[x] : below[x];
      peak[x] = m > here[x] ? m : here[x];
    }
    for (int x = margin; x < width_ - margin; ++x) {
      const float r = here[x];
      if (r < threshold || r < peak[x] || r < peak[x - 1] || r < peak[x + 1]) continue;
      if (mask.data && mask.at(x, y) < 0) continue;
      if (candidates_.size() == candidates_.capacity()) return;  // only plateaus can fill it
      const auto index = static_cast<uint32_t>(y * width_ + x);
      candidates_.push_back(uint64_t{std::bit_cast<uint32_t>(r)} << 32 | ~index);
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
  largest_ = 0;
  for (int y = 1; y < height_ - 1; ++y) {
    gradient_row(image, y);
    if (y >= 3) response_row(y - 1);
  }
  collect(mask);
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

}  // namespace takt::ego_motion
