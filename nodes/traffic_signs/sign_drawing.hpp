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
  double width_m, height_m;         ///< of the sign's outline
  int window_width, window_height;  ///< of its cascade, px; the sign fills all but kMargin of it on every side
};

/// In the order of SignClass. German signs 205, 206, 306, 209-10, 209-20, 220 and a traffic light.
inline constexpr std::array<SignShape, 7> kSignShapes{{
    {SignClass::yield, "yield", 0.90, 0.80, 24, 22},
    {SignClass::stop, "stop", 0.90, 0.90, 24, 24},
    {SignClass::priority, "priority", 0.84, 0.84, 24, 24},
    {SignClass::arrow_left, "arrow_left", 0.60, 0.60, 24, 24},
    {SignClass::arrow_right, "arrow_right", 0.60, 0.60, 24, 24},
    {SignClass::one_way, "one_way", 0.80, 0.30, 40, 18},
    {SignClass::traffic_light, "traffic_light", 0.35, 0.90, 14, 32},
}};

/// Draws one of the sign's looks (faded or not, the arrow of one_way to either side, any lamp lit) into `image` (BGR,
/// 0..255): turned by up to 35 deg about the upright axis, 12 deg about the level one, 6 deg in the image, so that it
/// fits into `area` and touches two of its sides. Gives the box around it. Sub-pixel; equal states of `random` give
/// equal pictures.
cv::Rect2f draw_sign(cv::Mat3f& image, SignClass sign, const cv::Rect2f& area, cv::RNG& random);

}  // namespace takt::traffic_signs
