// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/icp.hpp"

#include <cmath>

namespace takt::laser_fusion {

PoseParameters icp_step(const Matcher& matcher, const PoseParameters& pose, const Locks& locks) {
  return matcher.pairs().pairs < kLeastPairs ? pose : fit_rigid(matcher.pairs(), pose, locks);
}

IcpResult icp(Matcher& matcher, const Rigid& start, const IcpParameters& p) {
  PoseParameters pose = to_parameters(start);
  IcpResult best{to_rigid(pose), matcher.evaluate(to_rigid(pose)), 0};
  double score = best.quality.score;
  for (int i = 1; i <= p.iterations && std::isfinite(score); ++i) {
    pose = icp_step(matcher, pose, p.locks);
    const Quality quality = matcher.evaluate(to_rigid(pose));
    best.iterations = i;
    if (quality.score < best.quality.score) best = {to_rigid(pose), quality, i};
    if (std::abs(score - quality.score) < p.eps_conv) break;
    score = quality.score;
  }
  return best;
}

}  // namespace takt::laser_fusion
