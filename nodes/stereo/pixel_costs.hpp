// SPDX-License-Identifier: Apache-2.0
// Internal: costs of one pixel for the search range, of every kind, one disparity after the other.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/stereo/parameters.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// What a cost compares of an image: the channels, their derivatives, or the census bits. Takes memory once.
class Features {
 public:
  Features(int width, int height, int channels, CostKind cost);
  /// `mirror`: the columns reversed.
  void make(ImageView<const uint8_t> image, bool mirror);

  /// Truncated cost of pixel (x, y) of this image against (xo, y) of the other one; c_max outside of it.
  float cost(const Features& other, int x, int xo, int y, const MatcherParameters& p) const;
  /// Channel c of pixel (x, y), which may lie outside: the border is replicated.
  int level(int x, int y, int c) const;
  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  int grey(int x, int y) const;
  void make_derivatives(bool mirror);
  void make_census();
  float squared_difference(const Features& other, size_t i, size_t o) const;

  int width_, height_, channels_;
  CostKind cost_;
  std::vector<uint8_t> pixels_;
  std::vector<int16_t>
      derivatives_;  ///< twice the derivative along x, then along y, of grey (gradient) or each channel
  std::vector<uint64_t> census_;
};

}  // namespace takt::stereo
