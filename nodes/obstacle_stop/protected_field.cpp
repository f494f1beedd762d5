// SPDX-License-Identifier: Apache-2.0
#include "nodes/obstacle_stop/protected_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::obstacle_stop {
namespace {

// Below this the circle differs from a line by less than half a micrometre per metre of way.
constexpr double kStraight_rad = 1e-6;

/// The robot frame's x and y of the sensor's x and y axes (from the quaternion), and the sensor's place.
struct PlaneTransform {
  double xx, xy, yx, yy, x, y;
};

PlaneTransform to_plane(const Transform& t) {
  return {1 - 2 * (t.qy * t.qy + t.qz * t.qz),
          2 * (t.qx * t.qy + t.qw * t.qz),
          2 * (t.qx * t.qy - t.qw * t.qz),
          1 - 2 * (t.qx * t.qx + t.qz * t.qz),
          t.x,
          t.y};
}

}  // namespace

double stopping_time_s(const Drive& drive, const Braking& braking) {
  return braking.reaction_s + std::max(std::abs(drive.speed_m_s) / (2 * braking.deceleration_m_s2),
                                       std::abs(drive.turn_rad_s) / (2 * braking.turn_deceleration_rad_s2));
}

ProtectedField::ProtectedField(const Footprint& footprint, const Drive& drive, double time_s)
    : footprint_(footprint), distance_m_(drive.speed_m_s * time_s), angle_rad_(drive.turn_rad_s * time_s) {
  if (std::abs(angle_rad_) >= kStraight_rad) centre_x_m_ = -drive.speed_m_s / drive.turn_rad_s;
  reach_m_ = std::abs(distance_m_) + std::hypot(footprint.half_width_m, std::max(footprint.front_m, footprint.rear_m));
}

bool ProtectedField::in_footprint(double x, double y) const {
  return std::abs(x) <= footprint_.half_width_m && y >= -footprint_.rear_m && y <= footprint_.front_m;
}

bool ProtectedField::contains(double x, double y) const {
  if (!(x * x + y * y <= reach_m_ * reach_m_)) return false;  // NaN fails as well
  if (std::abs(angle_rad_) < kStraight_rad)
    return std::abs(x) <= footprint_.half_width_m && y >= -footprint_.rear_m + std::min(0.0, distance_m_) &&
           y <= footprint_.front_m + std::max(0.0, distance_m_);
  return in_footprint(x, y) || arc_meets_footprint(x, y);
}

// Seen from the robot a fixed point runs backwards along the circle through it; it is swept if its arc meets the
// footprint. It starts outside, so the arc would have to cross an edge.
bool ProtectedField::arc_meets_footprint(double x, double y) const {
  const double dx = x - centre_x_m_, radius = std::hypot(dx, y), from = std::atan2(y, dx);
  const auto& f = footprint_;
  for (const double edge_x : {-f.half_width_m, f.half_width_m}) {
    const double square = radius * radius - (edge_x - centre_x_m_) * (edge_x - centre_x_m_);
    if (square < 0) continue;
    for (const double edge_y : {-std::sqrt(square), std::sqrt(square)})
      if (edge_y >= -f.rear_m && edge_y <= f.front_m && swept_to(edge_x, edge_y, from)) return true;
  }
  for (const double edge_y : {-f.rear_m, f.front_m}) {
    const double square = radius * radius - edge_y * edge_y;
    if (square < 0) continue;
    for (const double edge_x : {centre_x_m_ - std::sqrt(square), centre_x_m_ + std::sqrt(square)})
      if (std::abs(edge_x) <= f.half_width_m && swept_to(edge_x, edge_y, from)) return true;
  }
  return false;
}

// Whether the point at angle `from` of its circle comes to (x, y) of that circle before the robot stands.
bool ProtectedField::swept_to(double x, double y, double from) const {
  constexpr double kTurn = 2 * std::numbers::pi;
  const double to = std::atan2(y, x - centre_x_m_);
  double way = std::fmod(angle_rad_ > 0 ? from - to : to - from, kTurn);
  if (way < 0) way += kTurn;
  return way <= std::abs(angle_rad_);
}

FieldReading read_field(const Sweep& sweep, const ProtectedField& field, int beams_min) {
  const PlaneTransform t = to_plane(sweep.sensor_in_robot);
  FieldReading reading;
  int run = 0;
  double nearest = 0;
  for (size_t i = 0; i < sweep.range_m.size(); ++i) {
    const double range = static_cast<double>(sweep.range_m[i]);
    // Counter-clockwise from the sensor's forward axis, which is its y.
    const double angle = sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
    const double x = -range * std::sin(angle), y = range * std::cos(angle);
    if (!(range > 0) || !field.contains(t.xx * x + t.yx * y + t.x, t.xy * x + t.yy * y + t.y)) {
      run = 0;
      continue;
    }
    nearest = run++ == 0 ? range : std::min(nearest, range);
    if (run < beams_min) continue;
    reading.nearest_m = reading.blocked ? std::min(reading.nearest_m, nearest) : nearest;
    reading.blocked = true;
  }
  return reading;
}

}  // namespace takt::obstacle_stop
