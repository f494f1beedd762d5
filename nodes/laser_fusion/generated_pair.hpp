// SPDX-License-Identifier: Apache-2.0
// Pairs of clouds whose relative pose is known: what a laser and a camera see of a furnished room.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "nodes/laser_fusion/pose_parameters.hpp"

namespace takt::laser_fusion {

struct PairParameters {
  size_t points = 1000;  ///< of each cloud
  double overlap = 1;    ///< share of the laser's view that the camera sees, too; 0..1
  double offset_m = 1, offset_rad = 1.0472;
  double laser_sigma_m = 0.003, vision_sigma_m = 0.02;  ///< noise of each coordinate
};

struct CloudPair {
  cloud::Cloud laser, vision;  ///< coloured by what was hit
  Rigid vision_in_laser;  ///< true: exactly so far and turned by so much, in a random direction about a random axis
};

/// A room of its own for every seed: walls, floor, ceiling, a dozen boxes on the floor and at the walls. Both sensors
/// stand in the same place, 1 m above the floor, and send rays at random into 120 degrees x 70 degrees; the camera's
/// view is turned away from the laser's as far as the overlap says. So no point is seen twice.
CloudPair generate_pair(const PairParameters& parameters, uint64_t seed);

/// A pair with its vision cloud moved, so that vision_in_laser is exactly so far and turned by so much as
/// generate_pair() has it: a recorded pair as one to be registered from the identity.
CloudPair displaced(const CloudPair& pair, double offset_m, double offset_rad, uint64_t seed);

}  // namespace takt::laser_fusion
