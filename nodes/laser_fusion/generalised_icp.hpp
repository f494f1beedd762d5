// SPDX-License-Identifier: Apache-2.0
// Generalised ICP (Segal, Haehnel and Thrun, "Generalized-ICP", 2009): a point stands for the piece of surface around
// it, so a pair is brought together across its surfaces and may slide along them. What genetic ICP is measured against;
// PCL has the original, whose package brings 257 others along.
#pragma once
#include <vector>

#include "nodes/laser_fusion/matcher.hpp"

namespace takt::laser_fusion {

struct GeneralisedIcpParameters {
  size_t neighbours = 20;               ///< of a point, itself included, that tell its surface
  double flatness = 1e-3;               ///< variance across a surface, that along it being 1
  int iterations = 100;                 ///< at most
  double eps_m = 1e-5, eps_rad = 1e-5;  ///< converged when it moves by less
};

class GeneralisedIcp {
 public:
  /// For the clouds that the matcher has, of metric truncated; its cut may change later. Looks at every point for each:
  /// for thinned clouds.
  explicit GeneralisedIcp(Matcher& matcher, const GeneralisedIcpParameters& parameters = {});

  /// Gauss-Newton on the sum of d^T (C1 + R C2 R^T)^-1 d over the pairs within the cut, found anew for each step;
  /// d = p1 - (R p2 + t), C the covariances of the surfaces.
  Rigid run(const Rigid& start);

 private:
  ego_motion::Twist step_from(const Rigid& pose) const;

  Matcher* matcher_;
  GeneralisedIcpParameters parameters_;
  std::vector<Eigen::Matrix3d> fixed_, moving_;
};

}  // namespace takt::laser_fusion
