// SPDX-License-Identifier: Apache-2.0
// From pixels to the flat floor and back (thesis Eq. 4.5 - 4.8, in the exact form of algorithm reference 7.5 and for
// any pose of the camera).
#pragma once
#include <array>
#include <optional>

#include "rt/msg/messages.hpp"

namespace takt::ground_map {

struct FloorPoint {
  double x_m, y_m;
};
struct ImagePoint {
  double x_px, y_px;
};

/// Position and direction on the floor: p_parent = Rz(yaw) p_child + (x, y).
struct PlanarPose {
  double x_m = 0, y_m = 0, yaw_rad = 0;
  FloorPoint apply(const FloorPoint& p) const;
};

/// The part of a pose that lies in the floor: yaw of R = Rz(yaw) Rx(pitch) Ry(roll).
PlanarPose planar(const Transform& transform);

/// Homogeneous map of pixels (x_px, y_px, 1) to the floor z = 0; row-major. A pixel sees the floor where the third
/// coordinate, by how much its ray falls per unit of depth, is above kHorizon.
struct FloorProjection {
  static constexpr double kHorizon = 1e-6;
  std::array<double, 9> h{};

  std::optional<FloorPoint> floor_at(double x_px, double y_px) const;
  /// The pixel that sees a point of the floor, inside the image or not; none where it lies behind the camera.
  std::optional<ImagePoint> pixel_at(const FloorPoint& point) const;
  /// To the floor of the frame in which `pose` is that of this one's.
  FloorProjection moved(const PlanarPose& pose) const;
  /// With floor coordinates (p - origin) / unit instead.
  FloorProjection scaled(const FloorPoint& origin, double unit_m) const;
};

/// `camera` with focal_px > 0; camera frame x right, y down, z forward; parent z up with the floor at z = 0 below it.
FloorProjection floor_projection(const CameraModel& camera, const Transform& camera_in_parent);

}  // namespace takt::ground_map
