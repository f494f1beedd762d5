// SPDX-License-Identifier: Apache-2.0
// How far a sign is and whether it has the size of one.
#pragma once
#include <vector>

#include "nodes/traffic_signs/sign_list.hpp"
#include "rt/msg/disparity.hpp"

namespace takt::traffic_signs {

/// Memory is taken by the constructor; the rest allocates nothing.
class DistanceMeter {
 public:
  explicit DistanceMeter(int most_disparities) : histogram_(static_cast<size_t>(most_disparities)) {}

  /// Z = f B / d in metres, d the median disparity in the middle half of the box, each way; 0 if less than a fifth of
  /// the pixels there have one, or the camera is not known.
  double distance_m(const DisparityMap& map, const Box& box);

 private:
  std::vector<int> histogram_;
};

/// Whether the box at that distance is `least` to `most` times as wide and high as the sign should be.
bool has_size(const SignModel& sign, const Box& box, double distance_m, double focal_px, double least, double most);

}  // namespace takt::traffic_signs
