// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/fusion.hpp"

#include <algorithm>
#include <cmath>

namespace takt::laser_fusion {

double match_confidence(double distance_m, double sigma_m) {
  const double q = distance_m / sigma_m;
  return std::exp(-0.5 * q * q);
}

double farthest_match_m(const FusionParameters& p) { return p.sigma_m * std::sqrt(-2 * std::log(p.confidence_min)); }

Colour confidence_colour(double confidence) {
  const auto green = static_cast<uint8_t>(std::lround(255 * std::clamp(confidence, 0.0, 1.0)));
  return {0, green, static_cast<uint8_t>(255 - green)};
}

}  // namespace takt::laser_fusion
