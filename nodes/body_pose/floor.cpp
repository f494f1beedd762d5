// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/floor.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace takt::body_pose {
namespace {

using Eigen::Vector3d;

constexpr int kTriples = 500, kRefinements = 5;
constexpr size_t kSamples = 2000;

/// normal . p = -height for the points of the floor; the normal points up.
struct Plane {
  Vector3d normal;
  double height_m;
  double above(const Point& p) const { return normal.dot(Vector3d(p.x, p.y, p.z)) + height_m; }
};

bool allowed(const Plane& plane, const FloorParameters& p) {
  return -plane.normal.y() >= std::cos(p.tilt_max_rad) && plane.height_m >= p.height_min_m &&
         plane.height_m <= p.height_max_m;
}

/// Points in the plane; none if too many lie below it: then it is a table, or what stands on the floor.
int support(const Plane& plane, std::span<const Point> points, size_t step, const FloorParameters& p) {
  int in = 0, below = 0, all = 0;
  for (size_t i = 0; i < points.size(); i += step, ++all) {
    const double above = plane.above(points[i]);
    in += std::abs(above) <= p.near_m ? 1 : 0;
    below += above < -4 * p.near_m ? 1 : 0;
  }
  return below <= p.below_max * all && in >= p.share_min * all ? in : 0;
}

/// Least squares on the points in the plane.
void refine(Plane& plane, std::span<const Point> points, size_t step, const FloorParameters& p) {
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;
  for (size_t i = 0; i < points.size(); i += step) {
    if (std::abs(plane.above(points[i])) > p.near_m) continue;
    const Vector3d v(points[i].x, points[i].y, points[i].z);
    sum += v;
    squares += v * v.transpose();
    ++count;
  }
  if (count < 3) return;
  const Vector3d mean = sum / count;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(squares / count - mean * mean.transpose());
  Vector3d normal = axes.eigenvectors().col(0);
  if (normal.y() > 0) normal = -normal;
  const Plane refined{normal, -normal.dot(mean)};
  if (allowed(refined, p)) plane = refined;
}

}  // namespace

std::optional<Transform> find_floor(std::span<const Point> points, const FloorParameters& p) {
  if (points.size() < 3) return std::nullopt;
  const size_t step = (points.size() + kSamples - 1) / kSamples;
  std::mt19937_64 random(1);
  const auto any = [&] {
    const Point& q = points[random() % points.size()];
    return Vector3d(q.x, q.y, q.z);
  };
  Plane best{};
  int most = 0;
  for (int i = 0; i < kTriples; ++i) {
    const Vector3d a = any(), b = any(), c = any();
    Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-6) continue;
    normal.normalize();
    if (normal.y() > 0) normal = -normal;
    const Plane plane{normal, -normal.dot(a)};
    if (!allowed(plane, p)) continue;
    if (const int in = support(plane, points, step, p); in > most) most = in, best = plane;
  }
  if (most == 0) return std::nullopt;
  for (int i = 0; i < kRefinements; ++i) refine(best, points, step, p);
  // Rows: the floor frame's axes in the camera's. Ahead is where the camera looks, along the floor.
  Eigen::Matrix3d rotation;
  const Vector3d up = best.normal, ahead = (Vector3d::UnitZ() - up * up.z()).normalized();
  rotation << ahead.cross(up).transpose(), ahead.transpose(), up.transpose();
  const Eigen::Quaterniond q(rotation);
  return Transform{0, 0, best.height_m, q.w(), q.x(), q.y(), q.z()};
}

}  // namespace takt::body_pose
