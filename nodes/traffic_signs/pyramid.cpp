// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/pyramid.hpp"

#include <algorithm>
#include <cmath>

namespace takt::traffic_signs {
namespace {

constexpr int kBlock = 64;  // a kernel reads at most this many sums beyond the end of a row

int round_even(double value) { return static_cast<int>(std::nearbyint(value)); }

}  // namespace

std::vector<Level::Tap> Level::taps(int from, int to) {
  std::vector<Tap> taps;
  const double ratio = 1.0 / (static_cast<double>(to) / from);  // in these two steps, as OpenCV does
  for (int i = 0; i < to; ++i) {
    const double position = ratio * (i + 0.5) - 0.5;
    const int at = static_cast<int>(std::floor(position));
    const bool inside = at >= 0 && at < from - 1;
    const int first = std::clamp(at, 0, from - 1);
    taps.push_back(
        {first, inside ? first + 1 : first, static_cast<uint16_t>(inside ? round_even((position - at) * 256) : 0)});
  }
  return taps;
}

int scales(int width, int height, double factor, int window_width, int window_height) {
  int count = 0;
  for (double scale = 1; round_even(window_width * scale) <= width && round_even(window_height * scale) <= height;
       scale *= factor)
    ++count;
  return count;
}

Pyramid::Pyramid(int width, int height, double factor, int levels) : levels_(static_cast<size_t>(levels)) {
  double scale = 1;
  for (Level& level : levels_) {
    level.scale = static_cast<float>(scale);
    level.width = round_even(static_cast<float>(width) / level.scale);
    level.height = round_even(static_cast<float>(height) / level.scale);
    level.step = level.scale >= 2 ? 1 : 2;
    level.half_ = (level.width + 2) / 2 + kBlock;
    level.stride_ = level.step == 1 ? level.width + 1 : 2 * level.half_;
    level.columns_ = Level::taps(width, level.width);
    level.rows_ = Level::taps(height, level.height);
    level.grey_.resize(static_cast<size_t>(level.width) * static_cast<size_t>(level.height));
    const size_t sums = static_cast<size_t>(level.stride_) * static_cast<size_t>(level.height + 1) + 2 * kBlock;
    level.sums_.resize(sums);
    level.squares_.resize(sums);
    scale *= factor;
  }
  upper_.resize(levels_.empty() ? 0 : levels_[0].columns_.size());
  lower_.resize(upper_.size());
}

void Pyramid::build(int index, ImageView<const uint8_t> grey) {
  Level& level = levels_[static_cast<size_t>(index)];
  const auto scale_row = [&](int y, std::vector<uint16_t>& out) {
    const uint8_t* row = grey.row(y);
    for (size_t x = 0; x < level.columns_.size(); ++x) {
      const Level::Tap& tap = level.columns_[x];
      out[x] = static_cast<uint16_t>((256 - tap.share) * row[tap.at] + tap.share * row[tap.next]);
    }
  };
  int upper = -1, lower = -1;  // rows that the two buffers hold
  for (int y = 0; y < level.height; ++y) {
    const Level::Tap& tap = level.rows_[static_cast<size_t>(y)];
    if (tap.at == lower) {
      upper_.swap(lower_);
      std::swap(upper, lower);
    }
    if (upper != tap.at) scale_row(upper = tap.at, upper_);
    if (lower != tap.next) scale_row(lower = tap.next, lower_);
    uint8_t* out = level.grey_.data() + static_cast<ptrdiff_t>(y) * level.width;
    const uint32_t share = tap.share;
    for (size_t x = 0; x < static_cast<size_t>(level.width); ++x)
      out[x] = static_cast<uint8_t>(((256 - share) * upper_[x] + share * lower_[x] + 0x8000) >> 16);
  }
  level.integrate();
}

void Level::integrate() {
  for (int y = 0; y < height; ++y) {
    const uint8_t* row = grey_.data() + static_cast<ptrdiff_t>(y) * width;
    uint32_t sum = 0, square = 0;
    const auto add = [&](int x) {
      const uint32_t pixel = row[x - 1];
      sum += pixel;
      square += pixel * pixel;
      const auto above = static_cast<size_t>(at(x, y)), here = static_cast<size_t>(at(x, y + 1));
      sums_[here] = static_cast<int32_t>(static_cast<uint32_t>(sums_[above]) + sum);
      squares_[here] = static_cast<int32_t>(static_cast<uint32_t>(squares_[above]) + square);
    };
    for (int x = 1; x <= width; ++x) add(x);
  }
}

}  // namespace takt::traffic_signs
