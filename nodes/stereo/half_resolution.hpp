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
/// there is one of 2 d here, a fraction included where both have one; rejected pixels stay -1. An odd last row or
/// column repeats the one before. Sizes are not checked.
void enlarge(const DisparityViews& in, const DisparityViews& out);

/// A matcher whose answer comes from half resolution: the same size and the same unit (disparities in px of the full
/// image, all of them even without fractions), and the confidence of the window that decided. Windows have half the
/// edge in pixels, so they see as much of the scene.
class HalfMatcher final : public Matcher {
 public:
  /// For images of that full size. Throws std::invalid_argument for parameters that problem() objects to.
  HalfMatcher(int width, int height, int channels, const MatcherParameters& parameters);

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  /// In px of the full image.
  void limit_search(int disparities) override { matcher_->limit_search((disparities + 1) / 2); }
  void tune(const MatcherParameters& parameters) override;
  const char* target() const override { return matcher_->target(); }

 private:
  int width_, height_, channels_;
  std::unique_ptr<Matcher> matcher_;
  std::vector<uint8_t> left_, right_, confidence_, fraction_;
  std::vector<int16_t> disparity_;
};

}  // namespace takt::stereo
