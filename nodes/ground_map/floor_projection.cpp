// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/floor_projection.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>

#include "nodes/mapping_3d/pose.hpp"

namespace takt::ground_map {
namespace {

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Map<const Matrix> matrix(const FloorProjection& p) { return Eigen::Map<const Matrix>(p.h.data()); }

FloorProjection projection(const Matrix& m) {
  FloorProjection p;
  Eigen::Map<Matrix>(p.h.data()) = m;
  return p;
}

}  // namespace

FloorPoint transformed(const PlanarPose& child_in_parent, const FloorPoint& p) {
  const PlanarPose at = compose(child_in_parent, {p.x_m, p.y_m, 0});
  return {at.x_m, at.y_m};
}

// With R = Rz(yaw) Rx(pitch) Ry(roll) the image of the y axis is (-sin yaw cos pitch, cos yaw cos pitch, sin pitch).
PlanarPose planar(const Transform& t) {
  const mapping_3d::Affine a = mapping_3d::to_affine(t);
  return {t.x, t.y, std::atan2(-a.r[1], a.r[4])};
}

// The ray of pixel (i, j) has the direction d = R ((i - cu) / f, (j - cv) / f, 1) and meets z = 0 at t - d t_z / d_z.
// Times the fall w = -d_z this is (t_x w + t_z d_x, t_y w + t_z d_y, w): linear in (i, j, 1).
FloorProjection floor_projection(const CameraModel& camera, const Transform& camera_in_parent) {
  const mapping_3d::Affine a = mapping_3d::to_affine(camera_in_parent);
  Matrix rotation, pixel_to_ray, fall_to_floor;
  rotation << a.r[0], a.r[1], a.r[2], a.r[3], a.r[4], a.r[5], a.r[6], a.r[7], a.r[8];
  const double f = camera.focal_px;
  pixel_to_ray << 1 / f, 0, -camera.cu_px / f, 0, 1 / f, -camera.cv_px / f, 0, 0, 1;
  fall_to_floor << a.t[2], 0, -a.t[0], 0, a.t[2], -a.t[1], 0, 0, -1;
  return projection(fall_to_floor * rotation * pixel_to_ray);
}

std::optional<FloorPoint> FloorProjection::floor_at(double x_px, double y_px) const {
  const Eigen::Vector3d p = matrix(*this) * Eigen::Vector3d(x_px, y_px, 1);
  if (!(p.z() > kHorizon)) return std::nullopt;
  return FloorPoint{p.x() / p.z(), p.y() / p.z()};
}

// The fall changes in one direction along a row.
RowSpan FloorProjection::floor_of_row(int y, int width) const {
  const auto falls = [&](int x) { return h[6] * x + (h[7] * y + h[8]) > kHorizon; };
  const bool left = falls(0), right = falls(width - 1);
  if (left == right) return {y, 0, left ? width : 0};
  int same = 0, other = width - 1;  // as the left end, as the right end
  while (other - same > 1) {
    const int middle = (same + other) / 2;
    (falls(middle) == left ? same : other) = middle;
  }
  return left ? RowSpan{y, 0, other} : RowSpan{y, other, width};
}

std::optional<ImagePoint> FloorProjection::pixel_at(const FloorPoint& point) const {
  const Matrix m = matrix(*this);
  const double determinant = m.determinant();
  if (determinant == 0 || !std::isfinite(determinant)) return std::nullopt;
  const Eigen::Vector3d q = m.inverse() * Eigen::Vector3d(point.x_m, point.y_m, 1);
  // q is 1 / w times (x, y, 1): its last coordinate has the sign of w, which is positive before the camera.
  if (!(q.z() > 0)) return std::nullopt;
  return ImagePoint{q.x() / q.z(), q.y() / q.z()};
}

FloorProjection FloorProjection::moved(const PlanarPose& pose) const {
  const double c = std::cos(pose.theta_rad), s = std::sin(pose.theta_rad);
  Matrix m;
  m << c, -s, pose.x_m, s, c, pose.y_m, 0, 0, 1;
  return projection(m * matrix(*this));
}

FloorProjection FloorProjection::scaled(const FloorPoint& origin, double unit_m) const {
  Matrix m;
  m << 1 / unit_m, 0, -origin.x_m / unit_m, 0, 1 / unit_m, -origin.y_m / unit_m, 0, 0, 1;
  return projection(m * matrix(*this));
}

}  // namespace takt::ground_map
