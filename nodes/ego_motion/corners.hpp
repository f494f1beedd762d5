// SPDX-License-Identifier: Apache-2.0
// Shi-Tomasi "good features to track" (thesis Sec. 4.3, step 1): the smaller eigenvalue of the gradient matrix.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/ego_motion/plane.hpp"

namespace takt::ego_motion {

struct CornerParameters {
  int maximum = 800;       ///< corners kept
  double quality = 0.005;  ///< least eigenvalue as a share of the largest in the image
  int distance_px = 5;     ///< least distance of two corners (Chebyshev)
  int margin_px = 8;       ///< no corner nearer to the border
  int tile_px = 64;        ///< a tile may hold at most twice its fair share, so that one bush cannot take all corners
};

struct Corner {
  int16_t x = 0, y = 0;
};

/// Finds corners of images of one size. All memory is taken by the constructor; detect() allocates nothing.
class CornerDetector {
 public:
  CornerDetector() = default;
  CornerDetector(int width, int height, const CornerParameters& parameters);
  /// From the next detect() on; at most as many corners as the constructor was told. tile_px 8 or more.
  void tune(const CornerParameters& parameters);

  /// Strongest corners first. A pixel whose `mask` value is negative cannot be a corner (no disparity there); an empty
  /// view admits all. The result is valid until the next call.
  std::span<const Corner> detect(const Plane& image, ImageView<const int16_t> mask = {});
  /// Smaller eigenvalue of the summed gradient matrix (3 x 3 Sobel, 3 x 3 sum) at each pixel of the last image; 0 in a
  /// border of 2 px.
  ImageView<const float> response() const { return {response_.data(), width_, height_, 1, stride_}; }

  /// The slow, obvious response of one pixel: double loop, same arithmetic in the same order.
  static float response_reference(const Plane& image, int x, int y);
  /// The slow, obvious choice of corners by their response: every peak against all that were chosen before.
  static std::vector<Corner> select_reference(ImageView<const float> response, const CornerParameters& parameters,
                                              ImageView<const int16_t> mask = {});

 private:
  size_t tiles(int tile_px) const;
  float fill_response(const Plane& image);
  void collect(float largest, ImageView<const int16_t> mask);
  std::span<const Corner> select();

  int width_ = 0, height_ = 0;
  CornerParameters p_;
  ptrdiff_t stride_ = 0;
  std::vector<int16_t> smooth_, step_;
  std::vector<float> products_;  // gradient rows: a ring of three, and their sum
  std::vector<float> response_;
  std::vector<int32_t> peaks_;
  std::vector<uint64_t> candidates_;  // response bits above, inverted pixel index below: one integer order, no ties
  std::vector<uint8_t> taken_;        // pixels too near to a chosen corner
  std::vector<int> in_tile_;          // room for the smallest tiles
  std::vector<Corner> corners_;
};

}  // namespace takt::ego_motion
