// SPDX-License-Identifier: Apache-2.0
// Quality of a disparity map, from this matcher or any other, against ground truth.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/stereo/matcher.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Dense single-channel image of disparities in px that owns its pixels.
struct DisparityImage {
  int width = 0, height = 0;
  std::vector<float> pixels;
  float& at(int x, int y) { return pixels[index(x, y)]; }
  float at(int x, int y) const { return pixels[index(x, y)]; }

 private:
  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

struct StereoScore {
  double bad_1px_pct = 0;      ///< known and visible in the right image: missing, or wrong by more than 1 px
  double bad_1px_all_pct = 0;  ///< the same over all known pixels
  double bad_half_px_pct = 0;  ///< as bad_1px_pct, by more than half a pixel
  double density_pct = 0;      ///< share of the known pixels that have a disparity
  int64_t known = 0, visible = 0;
};

/// Ground truth from an 8- or 16-bit image: d = value / scale, 0 unknown.
DisparityImage ground_truth(ImageView<const uint8_t> image, double scale);
DisparityImage ground_truth(ImageView<const uint16_t> image, double scale);

/// A matcher's result, with its fractions if there are any: -1 stays missing.
DisparityImage to_disparity_image(ImageView<const int16_t> disparity);
DisparityImage to_disparity_image(const DisparityViews& views);

/// 1 where the ground truth is known and the right image sees the pixel: x - d >= 0, and no pixel of the same row that
/// is more than half a pixel of disparity nearer lands on the same right pixel (within 0.5 to 1 px).
std::vector<uint8_t> visible_in_right(const DisparityImage& truth);

/// Of equally large images; disparities below 0 or not a number are missing. Throws std::invalid_argument if the sizes
/// differ.
StereoScore score(const DisparityImage& disparity, const DisparityImage& truth);

}  // namespace takt::stereo
