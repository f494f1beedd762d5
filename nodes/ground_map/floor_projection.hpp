// SPDX-License-Identifier: Apache-2.0
// From pixels to the flat floor and back (thesis Eq. 4.5 - 4.8, in the exact form of and for
// any pose of the camera).
#pragma once
#include <array>
#include <optional>

#include "rt/msg/geometry.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::ground_map {

struct FloorPoint {
  double x_m, y_m;
};
struct ImagePoint {
  double x_px, y_px;
};

/// Pixels first .. last - 1 of row y.
struct RowSpan {
  int y, first, last;
};

/// A point of the child frame, seen from the parent frame.
FloorPoint transformed(const PlanarPose& child_in_parent, const FloorPoint& p);

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
  /// Pixels first .. last - 1 of row y see the floor, of 0 .. width - 1; first = last: none does.
  RowSpan floor_of_row(int y, int width) const;
  /// To the floor of the frame in which `pose` is that of this one's.
  FloorProjection moved(const PlanarPose& pose) const;
  /// With floor coordinates (p - origin) / unit instead.
  FloorProjection scaled(const FloorPoint& origin, double unit_m) const;
};

/// `camera` with focal_px > 0; camera frame x right, y down, z forward; parent z up with the floor at z = 0 below it.
FloorProjection floor_projection(const CameraModel& camera, const Transform& camera_in_parent);

}  // namespace takt::ground_map
