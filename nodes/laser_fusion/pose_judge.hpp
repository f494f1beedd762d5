// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/laser_fusion/quality.hpp"

namespace takt::laser_fusion {

/// What ICP and genetic ICP search with: it judges a pose and pairs the points for the next step.
class PoseJudge {
 public:
  virtual Quality evaluate(const Rigid& moving_in_fixed) = 0;
  /// Of the last evaluation: sums over the pairs it kept.
  virtual const PairSums& pairs() const = 0;

 protected:
  ~PoseJudge() = default;
};

}  // namespace takt::laser_fusion
