// SPDX-License-Identifier: Apache-2.0
// Iterative closest points (thesis Sec. 4.4.2): pairs of nearest points, the motion that fits them best, again.
#pragma once
#include "nodes/laser_fusion/pose_judge.hpp"

namespace takt::laser_fusion {

struct IcpParameters {
  double eps_conv = 1e-5;  ///< converged when the score changes by less from one step to the next
  int iterations = 100;    ///< at most; above 0
  Locks locks{};
};

struct IcpResult {
  Rigid moving_in_fixed;  ///< the best pose on the way
  Quality quality;
  int iterations;
};

/// One step from a pose whose evaluation is the judge's last one: the next pose, or the same if there are too few
/// pairs.
PoseParameters icp_step(const PoseJudge& judge, const PoseParameters& pose, const Locks& locks);

/// Needs similar clouds, a large overlap and a good start. Ends where the score no longer changes, or there is nothing
/// to go by.
IcpResult icp(PoseJudge& judge, const Rigid& start, const IcpParameters& parameters);

}  // namespace takt::laser_fusion
