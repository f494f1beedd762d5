// SPDX-License-Identifier: Apache-2.0
// Signs seen from the front, as they are met: two traffic signs of one kind differ in paint, proportions and age.
#pragma once
#include <opencv2/core.hpp>

#include "nodes/traffic_signs/sign_drawing.hpp"

namespace takt::traffic_signs {

/// Longer edge kFlatEdge_px; both pictures have the same size.
struct FlatSign {
  cv::Mat3b colour;  ///< BGR
  cv::Mat1b opaque;  ///< 255 on the sign, 0 beside it
};

inline constexpr int kFlatEdge_px = 192;

/// One of the sign's looks: paints, borders and arrows within what stands in streets (old and new prints, the arrow of
/// one_way to either side, any lamp lit); up to three spots of dirt or stickers; in one of four a shadow's edge.
FlatSign draw_flat(SignClass sign, cv::RNG& random);

/// What is like a sign and is none of the seven: solid and upright triangles, blue discs with other arrows, blue boards
/// without one, red rings, plain diamonds; just as worn.
FlatSign draw_flat_decoy(cv::RNG& random);

}  // namespace takt::traffic_signs
