// SPDX-License-Identifier: Apache-2.0
// Generated images with and without signs, to train cascades on and to measure them with. Everything follows from seed
// and index; nothing is taken from photographs.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "nodes/traffic_signs/sign_drawing.hpp"

namespace takt::traffic_signs {

struct PlacedSign {
  SignClass sign;
  Box box;
};

struct SignScene {
  cv::Mat3b image;  ///< BGR
  std::vector<PlacedSign> signs;
};

struct SceneParameters {
  int width = 640, height = 480;
  int most_signs = 4;                          ///< 0 .. most_signs, of any class, apart from one another
  double longest_min = 26, longest_max = 130;  ///< longer edge of a sign, px
  int shapes_min = 10, shapes_max = 60;        ///< of the clutter
  int most_decoys = 0;                         ///< 0 .. most_decoys things that are like signs
  double light_min = 0.5, light_max = 1.5;     ///< factor on the whole, cut off at 255; a fall of up to a third across
  double cast_max = 0.07;                      ///< share by which the light of a colour is off
  double motion_max = 0;                       ///< px that the image moves while it is taken
  double blur_max = 1.0;                       ///< sigma, px
  double noise_sigma = 3;
};

/// Noise of many scales, boxes, bars, triangles, discs and rows of stripes of any colour, some half transparent; signs;
/// then light, blur and noise.
SignScene make_scene(const SceneParameters& parameters, uint64_t seed, uint64_t index);

/// Frame 0 .. frames - 1 of a passage: one sign that comes closer, from the shortest to the longest edge and from the
/// middle outwards, before a background that grows; light, blur and noise anew in each frame.
SignScene make_passage(const SceneParameters& parameters, uint64_t seed, uint64_t index, int frame, int frames);

/// One window that shows the sign, moved by up to 4 % and scaled by up to 8 % off its place, on such a background, one
/// channel: taken at 1 to 4 times the window's size, blurred by up to 6 % of it and moved by up to 8 %, then scaled
/// down as the search does.
cv::Mat1b make_positive(SignClass sign, uint64_t seed, uint64_t index);

}  // namespace takt::traffic_signs
