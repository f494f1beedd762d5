// SPDX-License-Identifier: Apache-2.0
// The signs of thesis Tab. 3.4 from their geometry, and into images as a camera would see them.
#pragma once
#include <array>
#include <opencv2/core.hpp>
#include <string_view>

#include "nodes/traffic_signs/sign_list.hpp"

namespace takt::traffic_signs {

enum class SignClass : uint8_t { yield, stop, priority, arrow_left, arrow_right, one_way, traffic_light };

struct SignShape {
  SignClass sign;
  std::string_view name;
  SignColour colour;                ///< of most of it
  double width_m, height_m;         ///< of the sign's outline
  int window_width, window_height;  ///< of its cascade, px; the sign fills all but kMargin of it on every side
};

/// In the order of SignClass. German signs 205, 206, 306, 209-10, 209-20, 220 and a traffic light.
inline constexpr std::array<SignShape, 7> kSignShapes{{
    {SignClass::yield, "yield", SignColour::red, 0.90, 0.80, 24, 22},
    {SignClass::stop, "stop", SignColour::red, 0.90, 0.90, 24, 24},
    {SignClass::priority, "priority", SignColour::yellow, 0.84, 0.84, 24, 24},
    {SignClass::arrow_left, "arrow_left", SignColour::blue, 0.60, 0.60, 24, 24},
    {SignClass::arrow_right, "arrow_right", SignColour::blue, 0.60, 0.60, 24, 24},
    {SignClass::one_way, "one_way", SignColour::blue, 0.80, 0.30, 40, 18},
    {SignClass::traffic_light, "traffic_light", SignColour::any, 0.35, 0.90, 14, 32},
}};

/// Draws one of the sign's looks (flat_sign.hpp) into `image` (BGR, 0..255): turned by up to 35 deg about the upright
/// axis, 12 deg about the level one, 10 deg in the image, faded by up to 35 %, under light 0.45 to 1.15 of its own, so
/// that it fits into `area` and touches two of its sides. Gives the box around it. Sub-pixel; equal states of `random`
/// give equal pictures.
cv::Rect2f draw_sign(cv::Mat3f& image, SignClass sign, const cv::Rect2f& area, cv::RNG& random);

/// The same with something that is like a sign and none of them.
void draw_decoy(cv::Mat3f& image, const cv::Rect2f& area, cv::RNG& random);

}  // namespace takt::traffic_signs
