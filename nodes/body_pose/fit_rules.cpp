// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/fit_rules.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace takt::body_pose {

using Eigen::Matrix3f, Eigen::Vector3f;

double reference_density(std::span<const Point> points, double tube_m) {
  constexpr size_t kMost = 256;
  if (points.empty()) return 0;
  const size_t step = (points.size() + kMost - 1) / kMost;
  std::array<uint32_t, kMost> near{};
  size_t samples = 0;
  const auto squared = static_cast<float>(tube_m * tube_m);
  for (size_t i = 0; i < points.size(); i += step) {
    const Point a = points[i];
    uint32_t count = 0;
    for (const Point& b : points) {
      const float x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
      count += x * x + y * y + z * z <= squared ? 1 : 0;
    }
    near[samples++] = count;
  }
  const auto middle = near.begin() + static_cast<ptrdiff_t>(samples / 2);
  std::nth_element(near.begin(), middle, near.begin() + static_cast<ptrdiff_t>(samples));
  return *middle / (2 * tube_m);
}

Vector3f swing(const Vector3f& rest, const Vector3f& direction) {
  const Vector3f axis = rest.cross(direction);
  const float sine = axis.norm(), cosine = rest.dot(direction);
  if (sine > 1e-6f) return axis * (std::atan2(sine, cosine) / sine);
  if (cosine > 0) return Vector3f::Zero();
  return rest.unitOrthogonal() * std::numbers::pi_v<float>;
}

bool angles_allow(const Skeleton& skeleton, const Link& link, const Matrix3f& frame, const Vector3f& direction) {
  const Vector3f angles = swing(link.rest.cast<float>(), frame.transpose() * direction);
  const auto slack = static_cast<float>(skeleton.slack_rad);
  std::array<float, 3> low{-slack, -slack, -slack}, high{slack, slack, slack};
  for (const Dof& dof : link.dofs) {
    low[static_cast<size_t>(dof.axis)] = static_cast<float>(dof.min_rad);
    high[static_cast<size_t>(dof.axis)] = static_cast<float>(dof.max_rad);
  }
  for (int axis = 0; axis < 3; ++axis)
    if (angles[axis] < low[static_cast<size_t>(axis)] || angles[axis] > high[static_cast<size_t>(axis)]) return false;
  return true;
}

Matrix3f frame_of_followers(const Link& link, const Matrix3f& frame, const Vector3f& direction) {
  const Vector3f angles = swing(link.rest.cast<float>(), frame.transpose() * direction);
  const float angle = angles.norm();
  if (angle < 1e-6f) return frame;
  return frame * Eigen::AngleAxisf(angle, angles / angle).toRotationMatrix();
}

std::optional<double> shape_error(const FitParameters& p, const LinkTask& task, const Vector3f& end) {
  const Link& link = *task.link;
  const Vector3f offset = end - task.start;
  const double length = offset.norm(), ratio = length / link.length_m;
  if (ratio < p.length_min || ratio > p.length_max) return std::nullopt;
  double range = 0;
  for (const Dof& dof : link.dofs) range += dof.max_rad - dof.min_rad;
  range = link.dofs.empty() ? std::numbers::pi : range / static_cast<double>(link.dofs.size());
  const double cosine = std::clamp(static_cast<double>(offset.dot(task.direction)) / length, -1.0, 1.0);
  return std::abs(ratio - 1) + std::acos(cosine) / range;
}

std::optional<double> density_error(const FitParameters& p, double reference, size_t points, double length_m) {
  const double density = static_cast<double>(points) / length_m;
  if (density < p.density_min * reference) return std::nullopt;
  return reference > 0 ? std::max(0.0, 1 - density / reference) : 0.0;
}

LinkTask make_task(const Link& link, const Vector3f& start, const Matrix3f& frame, const Vector3f& direction) {
  return {&link, start, start + static_cast<float>(link.length_m) * direction, direction, frame};
}

LinkTask make_mirrored_task(const Link& link, const Vector3f& start, const Matrix3f& frame, const Link& partner,
                            const Vector3f& partner_vector) {
  const Vector3f vector = partner_vector * static_cast<float>(-link.length_m / partner.length_m);
  return {&link, start, start + vector, vector.normalized(), frame};
}

double yaw_of(int k, int n) { return 2 * std::numbers::pi * k / n; }

Matrix3f rotation_about_vertical(double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix().cast<float>();
}

int rotation_at(int i, int n) {
  int step = std::max(1, static_cast<int>(std::lround(n * 0.382)));  // the golden section of a turn
  while (std::gcd(step, n) != 1) ++step;
  return static_cast<int>(int64_t{i} * step % n);
}

HiddenEnds hidden_ends(const FitParameters& p, const LinkTask& task, const Vector3f& eye, const Vector3f& point) {
  HiddenEnds found;
  const Vector3f ray = (point - eye).normalized(), from_start = point - task.start;
  const auto length = static_cast<float>(task.link->length_m);
  const float half = from_start.dot(ray), root = half * half - from_start.squaredNorm() + length * length;
  if (!(root >= 0)) return found;
  for (const float behind : {-half - std::sqrt(root), -half + std::sqrt(root)})
    if (behind >= static_cast<float>(p.behind_m)) found.ends[found.count++] = point + behind * ray;
  return found;
}

bool is_covered(const FitParameters& p, const Cluster& cluster, const LinkTask& task, const Vector3f& end) {
  const auto squared = static_cast<float>(p.tube_m * p.tube_m);
  for (const float share : {0.25f, 0.5f, 0.75f}) {
    const Segment sight(cluster.eye, task.start + share * (end - task.start));
    if (std::none_of(cluster.points.begin(), cluster.points.end(),
                     [&](const Point& q) { return sight.squared_distance(q.x, q.y, q.z) <= squared; }))
      return false;
  }
  return true;
}

double away(const Vector3f& start, const Vector3f& eye, double yaw_rad) {
  const double x = start.x() - eye.x(), y = start.y() - eye.y(), distance = std::hypot(x, y);
  if (distance == 0) return 0;
  const double towards = (std::sin(yaw_rad) * x - std::cos(yaw_rad) * y) / distance;
  return (1 - towards) / 2;
}

uint32_t weight_of(const FitParameters& p, const Vector3f& start, const Point& point) {
  const float x = point.x - start.x(), y = point.y - start.y();
  const auto more = static_cast<uint32_t>(std::sqrt(x * x + y * y) / static_cast<float>(p.limb_m));
  return std::min(1 + more, kMostWeight);
}

double PoseError::total(const FitParameters& p, size_t used, size_t all) const {
  const double unused = all == 0 ? 0 : 1 - static_cast<double>(used) / static_cast<double>(all);
  return p.weight_distance * distance_m + p.weight_missing * missing + p.weight_unused * unused + p.weight_thin * thin +
         p.weight_away * away;
}

bool is_valid(const Skeleton& skeleton, const FitParameters& p, const Fit& fit) {
  std::array<double, kMostJoints> ratios{};
  std::array<Matrix3f, kMostJoints> follow;
  const Matrix3f body = rotation_about_vertical(fit.yaw_rad);
  follow[0] = body;
  double sum = 0;
  int count = 0;
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    if (!fit.fitted[i]) continue;
    const Vector3f offset = fit.ends[i] - fit.ends[link.parent];
    const Vector3f direction = offset.normalized();
    const Matrix3f& frame = link.follows_parent ? follow[link.parent] : body;
    if (!angles_allow(skeleton, link, frame, direction)) return false;
    follow[i] = frame_of_followers(link, frame, direction);
    sum += ratios[i] = offset.norm() / link.length_m;
    ++count;
  }
  for (size_t i = 1; i < skeleton.links.size(); ++i)
    if (fit.fitted[i] && std::abs(ratios[i] - sum / count) > 2 * p.sigma_length) return false;
  return count > 0;
}

}  // namespace takt::body_pose
