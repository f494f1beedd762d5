// SPDX-License-Identifier: Apache-2.0
// Image preparation of the second stage: each pixel's orientation index I_hog (thesis Eq. 3.12, 3.13; ).
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// Orientations of the gradient of the value channel V = max(B, G, R) under the Sobel operator: index
/// floor(count theta / 2 pi) with theta = atan2(Gy, Gx) in [0, 2 pi), x to the right, y downwards; none() where the
/// gradient is shorter than kShortest, and on the image's border. Exact for every gradient, with every SIMD target: an
/// approximate angle says which border of two bins is near, and on which side the gradient lies is decided with a slope
/// that floats cannot get wrong.
class OrientationBins {
 public:
  static constexpr int kShortest = 60;  ///< of 8-bit Sobel units, of which the longest gradient has 1,020 per axis

  /// `count`: orientations, a multiple of 4 and at most 360 (std::invalid_argument otherwise).
  explicit OrientationBins(int count);

  int count() const { return count_; }
  uint16_t none() const { return static_cast<uint16_t>(count_); }
  /// Index of one gradient.
  uint16_t of(int gx, int gy) const;
  /// V of one row of interleaved BGR pixels.
  static void values(const uint8_t* bgr, size_t width, uint8_t* value);
  /// Indices of a row of `width` pixels from the values of the row above, its own and the one below. Vectorised.
  void row(const uint8_t* above, const uint8_t* own, const uint8_t* below, size_t width, uint16_t* index) const;
  /// Indices of the rows from .. to - 1 of an image of three channels, one after another. `values`: room for V of
  /// kValueRows rows.
  void rows(ImageView<const uint8_t> bgr, int from, int to, uint8_t* values, uint16_t* index) const;
  static constexpr size_t kValueRows = 3;

 private:
  int count_;
  /// Border i of the first half quadrant, theta = 2 pi i / count: a slope halfway between the steepest gradient before
  /// the border and the flattest one on it or beyond. Of whole components up to 1,020 their slopes p / q and p' / q'
  /// differ by at least 1 / q q', so small - slope large of every gradient is at least 1 / 2 q' > 0.0004 away from 0;
  /// floats are off by less than 0.0001. One border more, which none reaches.
  std::vector<float> slopes_;
};

}  // namespace takt::object_detection
