// SPDX-License-Identifier: Apache-2.0
// A made stereo pair whose disparities are known: for evaluation and measurement without recordings.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/stereo/evaluate.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

struct GeneratedPair {
  int width = 0, height = 0;
  std::vector<uint8_t> left, right;  ///< BGR
  DisparityImage truth;              ///< of the left image, whole and fractional px

  ImageView<const uint8_t> left_view() const { return {left.data(), width, height, 3}; }
  ImageView<const uint8_t> right_view() const { return {right.data(), width, height, 3}; }
};

/// Textured ground that comes nearer towards the lower border (a slanted surface) and three upright boxes before it, at
/// a fifth to four fifths of `disparities`. Texture has a contrast of `contrast` grey levels over about 3 px, as a lens
/// leaves it; both images get independent Gaussian noise of `noise_sigma` grey levels. The same seed gives the same
/// pair.
GeneratedPair generate_pair(int width, int height, int disparities, double contrast, double noise_sigma, uint64_t seed);

}  // namespace takt::stereo
