// SPDX-License-Identifier: Apache-2.0
#include "nodes/head_behaviour/gaze.hpp"

#include <algorithm>
#include <numbers>

namespace takt::head_behaviour {
namespace {

using mapping_3d::HeadAngles;
using mapping_3d::Position;

double floor_distance_m(const Position& a, const Position& b = {}) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

/// The face nearest to a place, if it is at most so far from it.
const Position* nearest(std::span<const Position> faces, const Position& to, double at_most_m) {
  const auto face = std::min_element(faces.begin(), faces.end(), [&](const Position& a, const Position& b) {
    return floor_distance_m(a, to) < floor_distance_m(b, to);
  });
  return face != faces.end() && floor_distance_m(*face, to) <= at_most_m ? &*face : nullptr;
}

/// Pan (left positive) and elevation of a direction in the robot frame.
HeadAngles angles_of(double x, double y, double z) { return {std::atan2(-x, y), std::atan2(z, std::hypot(x, y))}; }

}  // namespace

HeadAngles angles_towards(const Transform& at_rest, const Position& place) {
  const mapping_3d::Affine camera = mapping_3d::to_affine(at_rest);
  const HeadAngles rest = angles_of(camera.r[2], camera.r[5], camera.r[8]),
                   wanted = angles_of(place.x_m - at_rest.x, place.y_m - at_rest.y, place.z_m - at_rest.z);
  return {std::remainder(wanted.pan_rad - rest.pan_rad, 2 * std::numbers::pi), wanted.tilt_rad - rest.tilt_rad};
}

void Gaze::see(std::span<const Position> faces, int64_t now_ns) {
  const Position* face = partner_ ? nearest(faces, *partner_, parameters_.step_m) : nullptr;
  if (face && floor_distance_m(*face) > parameters_.leave_m) {
    partner_.reset();
    face = nullptr;
  }
  if (!partner_) face = nearest(faces, {}, parameters_.near_m);
  if (!face) return wait(now_ns);
  partner_ = *face;
  seen_ns_ = now_ns;
}

void Gaze::wait(int64_t now_ns) {
  if (partner_ && static_cast<double>(now_ns - seen_ns_) * 1e-9 > parameters_.hold_s) partner_.reset();
}

HeadAngles Gaze::look(const Transform& camera_at_rest) {
  HeadAngles wanted;
  if (partner_) wanted = angles_towards(camera_at_rest, *partner_);
  wanted = {std::clamp(wanted.pan_rad, -parameters_.pan_max_rad, parameters_.pan_max_rad),
            std::clamp(wanted.tilt_rad, -parameters_.tilt_max_rad, parameters_.tilt_max_rad)};
  const bool beside =
      std::hypot(wanted.pan_rad - angles_.pan_rad, wanted.tilt_rad - angles_.tilt_rad) > parameters_.still_rad;
  if (beside || !partner_) angles_ = wanted;
  return angles_;
}

}  // namespace takt::head_behaviour
