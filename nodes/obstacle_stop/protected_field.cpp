// SPDX-License-Identifier: Apache-2.0
#include "nodes/obstacle_stop/protected_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::obstacle_stop {
namespace {

// Below this the circle differs from a line by less than half a micrometre per metre of way.
constexpr double kStraight_rad = 1e-6;

double before_stop(double present, double wanted) {
  return present * wanted >= 0 && std::abs(wanted) > std::abs(present) ? wanted : present;
}

/// Whether the beam ends in the field at that range.
bool ends_in(const ProtectedField& field, const PlaneTransform& mount, const Sweep& sweep, size_t beam, double range) {
  const PlanarPoint place = mount.place(sweep, beam, range);
  return field.contains(place.x_m, place.y_m);
}

}  // namespace

Drive drive_before_stop(const Drive& present, const Drive& wanted) {
  return {before_stop(present.speed_m_s, wanted.speed_m_s), before_stop(present.turn_rad_s, wanted.turn_rad_s)};
}

double stopping_time_s(const Drive& drive, const Braking& braking) {
  return braking.reaction_s + std::max(std::abs(drive.speed_m_s) / (2 * braking.deceleration_m_s2),
                                       std::abs(drive.turn_rad_s) / (2 * braking.turn_deceleration_rad_s2));
}

ProtectedField::ProtectedField(const Footprint& footprint, const Drive& drive, double time_s)
    : footprint_(footprint),
      distance_m_(drive.speed_m_s * time_s),
      angle_rad_(drive.turn_rad_s * time_s),
      straight_(std::abs(angle_rad_) < kStraight_rad) {
  if (!straight_) centre_x_m_ = -drive.speed_m_s / drive.turn_rad_s;
  reach_m_ = std::abs(distance_m_) + footprint.clearance_m();
}

bool ProtectedField::in_margin(double x, double y, double longer_rear, double longer_front) const {
  const auto& f = footprint_;
  const double aside = std::max(std::abs(x) - f.half_width_m, 0.0),
               along = std::max({-f.rear_m - longer_rear - y, y - f.front_m - longer_front, 0.0});
  return aside * aside + along * along <= f.margin_m * f.margin_m;
}

// Within a quarter turn about a centre beside the robot such a place only moves on away from the edge.
bool ProtectedField::left_behind(double x, double y) const {
  const bool gently = straight_ || (std::abs(centre_x_m_) > footprint_.half_width_m + footprint_.margin_m &&
                                    std::abs(angle_rad_) <= std::numbers::pi / 2);
  if (!gently || !in_margin(x, y, 0, 0)) return false;
  return distance_m_ < 0 ? y > footprint_.front_m : distance_m_ > 0 && y < -footprint_.rear_m;
}

bool ProtectedField::contains(double x, double y) const {
  if (!(x * x + y * y <= reach_m_ * reach_m_) || left_behind(x, y)) return false;  // NaN fails as well
  if (straight_) return in_margin(x, y, std::max(0.0, -distance_m_), std::max(0.0, distance_m_));
  if (in_margin(x, y, 0, 0)) return true;
  // Seen from the robot a fixed point runs backwards along the circle through it; it is swept if its arc meets the
  // border of the margin, as it starts outside: four edges, and the corners' circles.
  const double dx = x - centre_x_m_, radius = std::hypot(dx, y), from = std::atan2(y, dx);
  return arc_meets_edge(radius, from) || arc_meets_corner(radius, from);
}

bool ProtectedField::arc_meets_edge(double radius, double from) const {
  const auto& f = footprint_;
  for (const double edge_x : {-f.half_width_m - f.margin_m, f.half_width_m + f.margin_m}) {
    const double square = radius * radius - (edge_x - centre_x_m_) * (edge_x - centre_x_m_);
    if (square < 0) continue;
    for (const double edge_y : {-std::sqrt(square), std::sqrt(square)})
      if (edge_y >= -f.rear_m && edge_y <= f.front_m && swept_to(edge_x, edge_y, from)) return true;
  }
  for (const double edge_y : {-f.rear_m - f.margin_m, f.front_m + f.margin_m}) {
    const double square = radius * radius - edge_y * edge_y;
    if (square < 0) continue;
    for (const double edge_x : {centre_x_m_ - std::sqrt(square), centre_x_m_ + std::sqrt(square)})
      if (std::abs(edge_x) <= f.half_width_m && swept_to(edge_x, edge_y, from)) return true;
  }
  return false;
}

bool ProtectedField::arc_meets_corner(double radius, double from) const {
  const auto& f = footprint_;
  for (const double x : {-f.half_width_m, f.half_width_m})
    for (const double y : {-f.rear_m, f.front_m}) {
      // Where the two circles meet: beyond the corner by `on` as seen from the centre, and `aside` to both sides.
      const double dx = x - centre_x_m_, away = std::hypot(dx, y);
      const double on = ((radius - away) * (radius + away) - f.margin_m * f.margin_m) / (2 * away);
      const double square = f.margin_m * f.margin_m - on * on;
      if (square < 0) continue;
      for (const double aside : {-std::sqrt(square), std::sqrt(square)})
        if (swept_to(x + (on * dx - aside * y) / away, y + (on * y + aside * dx) / away, from)) return true;
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
  const PlaneTransform mount(sweep.sensor_in_robot);
  FieldReading reading;
  int run = 0;
  double nearest = 0;
  for (size_t i = 0; i < sweep.range_m.size(); ++i) {
    const double range = static_cast<double>(sweep.range_m[i]);
    if (!(range > 0) || !ends_in(field, mount, sweep, i, range)) {
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

bool could_hide(const Sweep& sweep, const ProtectedField& field, double width_m) {
  constexpr double kStep_m = 0.05;
  const PlaneTransform mount(sweep.sensor_in_robot);
  const double farthest = field.reach_m() + std::hypot(mount.x, mount.y);
  const auto blind = [&](size_t i) { return i < sweep.range_m.size() && std::isnan(sweep.range_m[i]); };
  for (size_t first = 0, end = 0; first < sweep.range_m.size(); first = end + 1) {
    for (end = first; blind(end);) ++end;
    if (end == first) continue;
    // Nearer to the sensor the gap is too narrow.
    const double nearest = width_m / (static_cast<double>(end - first + 1) * sweep.step_rad);
    for (double range = std::max(nearest, kStep_m); range <= farthest; range += kStep_m) {
      size_t run = 0;
      for (size_t i = first; i < end; ++i) {
        run = ends_in(field, mount, sweep, i, range) ? run + 1 : 0;
        if (run > 0 && static_cast<double>(run + 1) * sweep.step_rad * range >= width_m) return true;
      }
    }
  }
  return false;
}

}  // namespace takt::obstacle_stop
