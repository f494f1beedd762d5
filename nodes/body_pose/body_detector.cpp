// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/body_detector.hpp"

#include <algorithm>

namespace takt::body_pose {

Cluster BodyDetector::cluster(size_t i) const {
  const Candidate& candidate = candidates_[i];
  const auto points = segmentation_.points().subspan(candidate.first, candidate.count);
  return {
      points, {candidate.head.x, candidate.head.y, candidate.head.z}, reference_density(points, p_.fit.tube_m), eye_};
}

void BodyDetector::keep(const Fit& fit, size_t candidate) {
  const auto links = std::count(fit.fitted.begin() + 1, fit.fitted.end(), true);
  if (fit.error > p_.error_max || links < p_.links_min) return;
  bodies_.push_back({fit, candidates_[candidate].top_m, is_valid(skeleton(), p_.fit, fit), candidate});
}

Eigen::Vector3f pointing_direction(const Fit& fit, const Pointer& pointer) {
  if (!fit.fitted[pointer.from] || !fit.fitted[pointer.to]) return Eigen::Vector3f::Zero();
  return (fit.ends[pointer.to] - fit.ends[pointer.from]).normalized();
}

Body to_message(const Skeleton& skeleton, const DetectedBody& body) {
  Body out{};
  out.error = static_cast<float>(body.fit.error);
  out.valid = body.valid ? 1 : 0;
  out.yaw_rad = static_cast<float>(body.fit.yaw_rad);
  out.top_m = body.top_m;
  for (size_t i = 0; i < skeleton.links.size(); ++i) {
    const Eigen::Vector3f& end = body.fit.ends[i];
    if (body.fit.fitted[i]) out.joints[i] = {end.x(), end.y(), end.z(), body.fit.hidden[i] ? 0.5f : 1.f};
  }
  for (size_t i = 0; i < skeleton.pointers.size(); ++i) {
    const Pointer& pointer = skeleton.pointers[i];
    const Eigen::Vector3f from = body.fit.ends[pointer.from], along = pointing_direction(body.fit, pointer);
    if (along.squaredNorm() > 0) out.pointing[i] = {from.x(), from.y(), from.z(), along.x(), along.y(), along.z()};
  }
  return out;
}

}  // namespace takt::body_pose
