// SPDX-License-Identifier: Apache-2.0
// Coloured laser points: the positions of the laser, the colours of the camera (thesis Sec. 4.4.3).
#pragma once
#include <cmath>
#include <span>

#include "nodes/cloud/cloud.hpp"
#include "nodes/laser_fusion/nearest_table.hpp"
#include "nodes/laser_fusion/pose_parameters.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

struct FusionParameters {
  double sigma_m = 0.10;        ///< of the distance between a laser point and its partner; about what vision resolves
  double confidence_min = 0.1;  ///< in 0..1, above 0; laser points with less are dropped
};

/// A laser point with the colour of its partner and their match probability.
struct FusedPoint {
  Point point;
  Colour colour;
  double confidence = 0;
};

/// Match probability of a laser point and a vision point at that distance: exp(-(d / sigma)^2 / 2), 1 at 0 (thesis
/// Eq. 4.19, corrected: E-30).
double match_confidence(double distance_m, double sigma_m);
/// Beyond this the confidence is below confidence_min.
double farthest_match_m(const FusionParameters& parameters);
/// From red (0) to green (1): green is the confidence in 1/255, red what is missing.
Colour confidence_colour(double confidence);

/// Tells take(laser point, colour, confidence) for every laser point with a vision point near enough, in their order.
/// `vision` holds the vision points with a reach of at least farthest_match_m(); colours are those points'.
template <class Take>
void fuse(std::span<const Point> laser, const NearestTable& vision, std::span<const Colour> colours,
          const Rigid& vision_in_laser, const FusionParameters& p, const Take& take) {
  const Rigid laser_in_vision = vision_in_laser.inverse();
  for (const Point& point : laser) {
    if (!cloud::usable(point)) continue;
    const Eigen::Vector3f place = (laser_in_vision * Eigen::Vector3d(point.x, point.y, point.z)).cast<float>();
    const Nearest near = vision.nearest({place.x(), place.y(), place.z()});
    if (near.index == Nearest::kNoPoint) continue;
    const double confidence = match_confidence(std::sqrt(near.distance2), p.sigma_m);
    if (confidence >= p.confidence_min) take(point, colours[near.index], confidence);
  }
}

}  // namespace takt::laser_fusion
