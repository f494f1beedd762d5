// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/laser_check.hpp"

#include <cmath>

#include "nodes/mapping_3d/pose.hpp"

namespace takt::ground_map {

bool area_is_free(const LaserScan& scan, const FloorProjection& projection, const ReferenceArea& area) {
  const mapping_3d::Affine a = mapping_3d::to_affine(scan.sensor_in_robot);
  for (uint32_t i = 0; i < scan.range_m.size; ++i) {
    const double range = scan.range_m[i];
    if (!(range > 0) || (scan.max_range_m > 0 && range >= scan.max_range_m)) continue;
    // Counter-clockwise from the forward axis y.
    const double angle = scan.first_angle_rad + i * scan.step_rad;
    const double x = -range * std::sin(angle), y = range * std::cos(angle);
    const FloorPoint foot{a.r[0] * x + a.r[1] * y + a.t[0], a.r[3] * x + a.r[4] * y + a.t[1]};
    const auto pixel = projection.pixel_at(foot);
    if (pixel && area.contains(pixel->x_px, pixel->y_px)) return false;
  }
  return true;
}

}  // namespace takt::ground_map
