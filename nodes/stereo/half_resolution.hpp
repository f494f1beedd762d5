// SPDX-License-Identifier: Apache-2.0
// Matching at half resolution over the same range: a quarter of the pixels and half of the disparities, about an eighth
// of the work of matching.
#pragma once
#include <algorithm>
#include <vector>

#include "nodes/stereo/matcher.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Size of the halved image: an odd last column or row is dropped, one pixel at least stays.
inline int half(int size) { return std::max(1, size / 2); }

/// Rounded mean of 2 x 2 pixels; `out` has half(width) x half(height) pixels and the channels of `in`, 1 or 3. In an
/// image one pixel wide or high a pixel is its own neighbour. Sizes are not checked.
void halve(ImageView<const uint8_t> in, ImageView<uint8_t> out);

/// Nearest neighbour to full size: half pixel i stands for 2 i and 2 i + 1. Disparities double, for a shift of d pixels
/// there is one of 2 d here; rejected pixels stay -1. An odd last row or column repeats the one before. Sizes are not
/// checked.
void enlarge(ImageView<const int16_t> disparity, ImageView<const uint8_t> confidence, ImageView<int16_t> disparity_out,
             ImageView<uint8_t> confidence_out);

/// A matcher with the contract of Matcher::match whose answer comes from half resolution: the same size and the same
/// unit (disparities in px of the full image, all of them even), and the confidence of the window that decided. Windows
/// have half the edge in pixels, so they see as much of the scene. Memory is taken by the constructor; match()
/// allocates nothing. One thread at a time.
class HalfMatcher {
 public:
  /// For images of that full size. Throws std::invalid_argument for parameters that problem() objects to.
  HalfMatcher(int width, int height, int channels, const MatcherParameters& parameters);

  /// As Matcher::match, with views of the full size.
  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<int16_t> disparity,
                           ImageView<uint8_t> confidence);
  /// As Matcher::limit_search, in px of the full image.
  void limit_search(int disparities) { matcher_.limit_search((disparities + 1) / 2); }

 private:
  int width_, height_, channels_;
  Matcher matcher_;
  std::vector<uint8_t> left_, right_, confidence_;
  std::vector<int16_t> disparity_;
};

}  // namespace takt::stereo
