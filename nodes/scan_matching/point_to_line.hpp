// SPDX-License-Identifier: Apache-2.0
// The exact place of a scan whose place is nearly known: iterative closest point with the distance from the line
// through the closest point (Chen and Medioni 1991; Censi, "An ICP variant using a point-to-line metric", 2008).
#pragma once
#include <span>

#include "nodes/scan_matching/correlative_search.hpp"
#include "nodes/scan_matching/local_map.hpp"

namespace takt::scan_matching {

struct RefineParameters {
  int iterations = 20;
  double scale_m = 0.05;      ///< residual at which a pair counts half (Cauchy)
  double noise_m = 0.01;      ///< least standard deviation of a residual, whatever they look like
  double beams_per_fact = 4;  ///< neighbouring beams err alike: so many are one independent measurement
};

struct Refined {
  PlanarPose robot_in_map;
  Covariance covariance = Covariance::Zero();
  /// Of what is known in the least known direction, the share that comes from the expectation and not from the scan:
  /// near 0 where walls stand in all directions, near 1 along a corridor without end.
  double prior_share = 1;
  int paired = 0;    ///< points that have a mapped one within the gate
  double rms_m = 0;  ///< of their distances from the lines, weighted
  bool converged = false;
};

using NearestPoint = const SurfacePoint* (LocalMap::*)(const SurfacePoint&) const;

/// Starts at `start`. Points without a normal are passed over.
Refined refine(const LocalMap& map, std::span<const SurfacePoint> points, const Expected& expected,
               const PlanarPose& start, const RefineParameters& parameters, NearestPoint nearest = &LocalMap::nearest);

}  // namespace takt::scan_matching
