// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/pixel_costs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace takt::stereo {

Features::Features(int width, int height, int channels, CostKind cost)
    : width_(width),
      height_(height),
      channels_(channels),
      cost_(cost),
      pixels_(static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels)) {
  const size_t count = at(0, height);
  if (cost == CostKind::gradient) derivatives_.resize(2 * count);
  if (cost == CostKind::mixed) derivatives_.resize(2 * count * static_cast<size_t>(channels));
  if (cost == CostKind::census) census_.resize(count);
}

int Features::level(int x, int y, int c) const {
  const size_t i = at(std::clamp(x, 0, width_ - 1), std::clamp(y, 0, height_ - 1));
  return pixels_[i * static_cast<size_t>(channels_) + static_cast<size_t>(c)];
}

int Features::grey(int x, int y) const {
  return channels_ == 1 ? level(x, y, 0) : grey_of(level(x, y, 0), level(x, y, 1), level(x, y, 2));
}

void Features::make(ImageView<const uint8_t> image, bool mirror) {
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      std::copy_n(&image.at(mirror ? width_ - 1 - x : x, y), channels_,
                  pixels_.begin() + static_cast<ptrdiff_t>(at(x, y)) * channels_);
  if (!derivatives_.empty()) make_derivatives(mirror);
  if (!census_.empty()) make_census();
}

/// In a mirror twice_derivative() would saturate the other way round: it is taken as without one.
void Features::make_derivatives(bool mirror) {
  const int before = mirror ? 1 : -1;
  auto out = derivatives_.begin();
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      if (cost_ == CostKind::gradient) {
        *out++ = twice_derivative(grey(x + before, y), grey(x - before, y));
        *out++ = twice_derivative(grey(x, y - 1), grey(x, y + 1));
        continue;
      }
      for (int c = 0; c < channels_; ++c) {
        *out++ = static_cast<int16_t>(level(x + 1, y, c) - level(x - 1, y, c));
        *out++ = static_cast<int16_t>(level(x, y + 1, c) - level(x, y - 1, c));
      }
    }
}

void Features::make_census() {
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      uint64_t bits = 0;
      for (int bit = 0; bit < kCensusBits; ++bit) {
        const CensusOffset o = census_offset(bit);
        if (grey(x + o.x, y + o.y) < grey(x, y)) bits |= uint64_t{1} << bit;
      }
      census_[at(x, y)] = bits;
    }
}

float Features::squared_difference(const Features& other, size_t i, size_t o) const {
  const auto n = static_cast<size_t>(channels_);
  int sum = 0;
  for (size_t c = 0; c < n; ++c) {
    const int difference = pixels_[i * n + c] - other.pixels_[o * n + c];
    sum += difference * difference;
  }
  return static_cast<float>(sum);
}

float Features::cost(const Features& other, int x, int xo, int y, const MatcherParameters& p) const {
  const auto most = static_cast<float>(p.truncation());
  if (x < 0 || xo < 0 || x >= width_ || xo >= width_) return most;
  const size_t i = at(x, y), o = at(xo, y);
  const auto difference = [&](size_t per_pixel, size_t k) {
    return derivatives_[i * per_pixel + k] - other.derivatives_[o * per_pixel + k];
  };
  switch (cost_) {
    case CostKind::gradient: {
      const int mean = (std::abs(difference(2, 0)) + std::abs(difference(2, 1)) + 1) / 2;
      return std::min(most, static_cast<float>(mean));
    }
    case CostKind::census: return std::min(most, static_cast<float>(std::popcount(census_[i] ^ other.census_[o])));
    case CostKind::ssd: return std::min(most, squared_difference(other, i, o));
    case CostKind::rss: return std::min(most, std::sqrt(squared_difference(other, i, o)));
    case CostKind::sad: {
      int sum = 0;
      const auto n = static_cast<size_t>(channels_);
      for (size_t c = 0; c < n; ++c) sum += std::abs(pixels_[i * n + c] - other.pixels_[o * n + c]);
      return std::min(most, static_cast<float>(sum));
    }
    case CostKind::mixed: break;
  }
  const auto w = static_cast<float>(p.intensity_weight);
  int of_derivatives = 0;  // of twice the derivatives: four times theirs
  const auto per_pixel = 2 * static_cast<size_t>(channels_);
  for (size_t k = 0; k < per_pixel; ++k) of_derivatives += difference(per_pixel, k) * difference(per_pixel, k);
  return std::min(most, w * squared_difference(other, i, o) + (1 - w) / 2 * static_cast<float>(of_derivatives) / 4);
}

}  // namespace takt::stereo
