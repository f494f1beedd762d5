// SPDX-License-Identifier: Apache-2.0
// An image at many scales, each with the sums that a sliding window needs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::traffic_signs {

/// The image at one scale with integral images: at (x, y) the sum of all pixels, or of their squares, left of and above
/// it; modulo 2^32, so that only differences mean anything. Windows stand at multiples of `step` in both directions.
/// Where that is two, the even columns of a row lie before the odd ones: windows beside one another then always have
/// neighbouring sums.
class Level {
 public:
  float scale = 1;  ///< this many pixels of the image are one of the level
  int width = 0, height = 0;
  int step = 1;

  /// Where (x, y), 0..width x 0..height, lies in sums and squares.
  ptrdiff_t at(int x, int y) const { return y * stride_ + (step == 1 ? x : x % 2 * half_ + x / 2); }
  /// Windows of `extent` beside (or below) one another in `length` pixels of the level.
  int windows(int length, int extent) const { return length < extent ? 0 : (length - extent) / step + 1; }
  const int32_t* sums() const { return sums_.data(); }
  const int32_t* squares() const { return squares_.data(); }
  ImageView<const uint8_t> grey() const { return {grey_.data(), width, height}; }

 private:
  friend class Pyramid;
  struct Tap {
    int at;  ///< first of two neighbours; the second is the next, or the same at the border
    int next;
    uint16_t share;  ///< of the second, 1/256
  };
  static std::vector<Tap> taps(int from, int to);
  void integrate();

  ptrdiff_t stride_ = 0, half_ = 0;
  std::vector<Tap> columns_, rows_;
  std::vector<uint8_t> grey_;
  std::vector<int32_t> sums_, squares_;
};

/// At how many scales factor^0, factor^1 ... a window is at most as large as the image. factor > 1.
int scales(int width, int height, double factor, int window_width, int window_height);

/// Scales are factor^0, factor^1 ... as those of cv::CascadeClassifier; each level is scaled from the image itself,
/// exactly as cv::resize does with INTER_LINEAR_EXACT. Memory is taken by the constructor; the rest allocates nothing.
class Pyramid {
 public:
  Pyramid(int width, int height, double factor, int levels);

  int levels() const { return static_cast<int>(levels_.size()); }
  const Level& level(int index) const { return levels_[static_cast<size_t>(index)]; }
  /// Scales `grey` (one channel, of the constructor's size: not checked) to one level and sums it up.
  void build(int index, ImageView<const uint8_t> grey);

 private:
  std::vector<Level> levels_;
  std::vector<uint16_t> upper_, lower_;  ///< two rows, scaled across, 1/256
};

}  // namespace takt::traffic_signs
