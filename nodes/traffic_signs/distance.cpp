// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/distance.hpp"

#include <algorithm>

namespace takt::traffic_signs {

double DistanceMeter::distance_m(const DisparityMap& map, const Box& box) {
  std::fill(histogram_.begin(), histogram_.end(), 0);
  const int left = std::max(0, box.x + box.width / 4), right = std::min(map.width, box.x + 3 * box.width / 4),
            top = std::max(0, box.y + box.height / 4), bottom = std::min(map.height, box.y + 3 * box.height / 4);
  int valid = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const int disparity = map.view().at(x, y);
      if (disparity <= 0 || disparity >= static_cast<int>(histogram_.size())) continue;
      ++histogram_[static_cast<size_t>(disparity)];
      ++valid;
    }
  if (valid == 0 || 5 * valid < (right - left) * (bottom - top)) return 0;
  int disparity = 0;
  for (int below = histogram_[0]; 2 * below < valid; below += histogram_[static_cast<size_t>(disparity)]) ++disparity;
  return map.camera.focal_px * map.camera.baseline_m / disparity;
}

bool has_size(const SignModel& sign, const Box& box, double distance_m, double focal_px, double least, double most) {
  const auto fits = [&](int extent_px, double nominal_m) {
    const double extent_m = extent_px * distance_m / focal_px;
    return extent_m >= least * nominal_m && extent_m <= most * nominal_m;
  };
  return fits(box.width, sign.width_m) && fits(box.height, sign.height_m);
}

}  // namespace takt::traffic_signs
