// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <limits>

#include "nodes/body_pose/fit_rules.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {
namespace {

using Eigen::Matrix3f, Eigen::Vector3f;

Vector3f vector_of(const Point& p) { return {p.x, p.y, p.z}; }

size_t points_along(const Cluster& cluster, const Vector3f& from, const Vector3f& to, double reach_m) {
  const Segment segment(from, to);
  size_t count = 0;
  for (const Point& q : cluster.points)
    count += segment.squared_distance(q.x, q.y, q.z) <= static_cast<float>(reach_m * reach_m) ? 1 : 0;
  return count;
}

/// Where the link best ends if no point shows it.
std::optional<Vector3f> find_hidden_end(const Skeleton& skeleton, const FitParameters& p, const Cluster& cluster,
                                        const LinkTask& task) {
  std::optional<Vector3f> best;
  double least = std::numeric_limits<double>::infinity();
  for (size_t at = 0; at < cluster.points.size(); at += kHidingStep) {
    const HiddenEnds hidden = hidden_ends(p, task, cluster.eye, vector_of(cluster.points[at]));
    for (size_t i = 0; i < hidden.count; ++i) {
      const Vector3f& end = hidden.ends[i];
      if ((end - task.aim).squaredNorm() > static_cast<float>(p.search_m * p.search_m)) continue;
      const auto e2 = shape_error(p, task, end);
      if (!e2 || !(*e2 < least)) continue;
      if (!angles_allow(skeleton, *task.link, task.frame, (end - task.start).normalized())) continue;
      if (!is_covered(p, cluster, task, end)) continue;
      least = *e2;
      best = end;
    }
  }
  return best;
}

/// findBestFit of Alg. 3.3.
std::optional<Vector3f> find_best_fit(const Skeleton& skeleton, const FitParameters& p, const Cluster& cluster,
                                      const LinkTask& task) {
  std::optional<Vector3f> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Point& q : cluster.points) {
    const Vector3f end = vector_of(q);
    if ((end - task.aim).squaredNorm() > static_cast<float>(p.search_m * p.search_m)) continue;
    const auto e2 = shape_error(p, task, end);
    if (!e2 || !angles_allow(skeleton, *task.link, task.frame, (end - task.start).normalized())) continue;
    const double length = (end - task.start).norm();
    const auto e1 = density_error(p, cluster.density, points_along(cluster, task.start, end, p.tube_m), length);
    if (!e1 || !(*e1 + *e2 < least)) continue;
    least = *e1 + *e2;
    best = end;
  }
  return best;
}

/// fitPose of Alg. 3.3, and what it costs.
Fit fit_pose(const Skeleton& skeleton, const FitParameters& p, const Cluster& cluster, size_t pose, int k) {
  Fit fit;
  fit.pose = pose;
  fit.yaw_rad = yaw_of(k, p.rotations);
  fit.ends[0] = cluster.start;
  fit.fitted[0] = true;
  const Matrix3f body = rotation_about_vertical(fit.yaw_rad);
  std::array<Matrix3f, kMostJoints> follow;
  follow[0] = body;
  PoseError error;
  error.away = away(cluster.start, cluster.eye, fit.yaw_rad);
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    std::optional<Vector3f> end;
    LinkTask task;
    if (fit.fitted[link.parent]) {
      const Vector3f start = fit.ends[link.parent];
      const Matrix3f& frame = link.follows_parent ? follow[link.parent] : body;
      const Link& partner = skeleton.links[link.mirrors];
      task = link.mirrors != 0 && fit.fitted[link.mirrors]
                 ? make_mirrored_task(link, start, frame, partner, fit.ends[link.mirrors] - fit.ends[partner.parent])
                 : make_task(link, start, frame, body * skeleton.poses[pose].directions[i].cast<float>());
      const auto look = [&] {
        end = find_best_fit(skeleton, p, cluster, task);
        fit.hidden[i] = !end;
        if (!end && link.descendants > 0) end = find_hidden_end(skeleton, p, cluster, task);
      };
      look();
      if (!end && link.follows_parent && link.parent != 0 && link.mirrors == 0) {
        task = make_task(link, start, frame, frame * link.rest.cast<float>());
        look();
      }
    }
    if (!end) {
      fit.hidden[i] = false;
      error.missing += p.missing_penalty * (1 + link.descendants);
      continue;
    }
    fit.ends[i] = *end;
    fit.fitted[i] = true;
    const Vector3f offset = *end - task.start;
    follow[i] = frame_of_followers(link, task.frame, offset.normalized());
    error.distance_m += (*end - task.aim).norm();
    const auto along = static_cast<double>(points_along(cluster, task.start, *end, p.tube_m));
    if (fit.hidden[i] || along / offset.norm() < p.density_low * cluster.density) error.thin += p.thin_penalty;
  }
  size_t used = 0, all = 0;
  for (const Point& q : cluster.points) {
    bool close = false;
    for (size_t i = 1; i < skeleton.links.size(); ++i)
      close = close || (fit.fitted[i] &&
                        Segment(fit.ends[skeleton.links[i].parent], fit.ends[i]).squared_distance(q.x, q.y, q.z) <=
                            static_cast<float>(p.close_m * p.close_m));
    const uint32_t weight = weight_of(p, cluster.start, q);
    used += close ? weight : 0;
    all += weight;
  }
  fit.error = error.total(p, used, all);
  return fit;
}

}  // namespace

Fit fit_reference(const Skeleton& skeleton, const FitParameters& p, const Cluster& cluster) {
  Fit best;
  best.error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < p.rotations; ++i)
    for (size_t pose = 0; pose < skeleton.poses.size(); ++pose) {
      const Fit fit = fit_pose(skeleton, p, cluster, pose, rotation_at(i, p.rotations));
      if (fit.error < best.error) best = fit;
    }
  best.searched = 1;
  return best;
}

}  // namespace takt::body_pose
