// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/icp.hpp"

#include <cmath>

namespace takt::laser_fusion {

PoseParameters icp_step(const PoseJudge& judge, const PoseParameters& pose, const Locks& locks) {
  return judge.pairs().pairs < kLeastPairs ? pose : fit_rigid(judge.pairs(), pose, locks);
}

IcpResult icp(PoseJudge& judge, const Rigid& start, const IcpParameters& p) {
  PoseParameters pose = to_parameters(start);
  IcpResult best{to_rigid(pose), judge.evaluate(to_rigid(pose)), 0};
  double score = best.quality.score;
  for (int i = 1; i <= p.iterations && std::isfinite(score); ++i) {
    pose = icp_step(judge, pose, p.locks);
    const Quality quality = judge.evaluate(to_rigid(pose));
    best.iterations = i;
    if (quality.score < best.quality.score) best = {to_rigid(pose), quality, i};
    if (std::abs(score - quality.score) < p.eps_conv) break;
    score = quality.score;
  }
  return best;
}

}  // namespace takt::laser_fusion
