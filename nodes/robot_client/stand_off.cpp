// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/stand_off.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace takt::robot_client {
namespace {

double distance_m(const Place& a, const Place& b) { return std::hypot(b.x_m - a.x_m, b.y_m - a.y_m); }

constexpr double kOff_m = 0.04;  // as far as the pilot may be off (unit tests of navigation)

bool reaches(const Place& from, std::span<const Place> objects, double reach_m) {
  return std::all_of(objects.begin(), objects.end(), [&](const Place& o) { return distance_m(from, o) <= reach_m; });
}

Place between(const Place& a, const Place& b, double share) {
  return {a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)};
}

/// Cells are coarse: the last piece of a way ends where all is within reach, whatever the pilot is off.
void end_within_reach(std::span<const Place> objects, double reach_m, std::vector<Place>& way) {
  const Place begin = way[way.size() - 2], end = way.back();
  double outside = 0, inside = 1;
  if (!reaches(end, objects, reach_m - kOff_m) || reaches(begin, objects, reach_m - kOff_m)) return;
  while (inside - outside > 1e-6) {
    const double middle = (outside + inside) / 2;
    (reaches(between(begin, end, middle), objects, reach_m - kOff_m) ? inside : outside) = middle;
  }
  way.back() = between(begin, end, inside);
}

}  // namespace

Disc enclosing(std::span<const Place> places) {
  Disc disc{places[0], 0};
  for (const Place& a : places)
    for (const Place& b : places)
      if (const double half = distance_m(a, b) / 2; half > disc.radius_m)
        disc = {{(a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2}, half};
  // Three and more may lie outside: towards the farthest, by less each time (Badoiu and Clarkson).
  for (int i = 2; i < 200 && places.size() > 2; ++i) {
    const auto nearer = [&](const Place& a, const Place& b) {
      return distance_m(disc.middle, a) < distance_m(disc.middle, b);
    };
    const Place& farthest = *std::max_element(places.begin(), places.end(), nearer);
    if (disc.contains(farthest)) break;
    disc.middle.x_m += (farthest.x_m - disc.middle.x_m) / i;
    disc.middle.y_m += (farthest.y_m - disc.middle.y_m) / i;
  }
  for (const Place& place : places) disc.radius_m = std::max(disc.radius_m, distance_m(disc.middle, place));
  return disc;
}

PathOutcome way_to_place(PathPlanner* planner, const Place& from, const Place& to, std::vector<Place>& way) {
  if (planner != nullptr) return planner->plan(from, to, 0, way);
  way.assign({from, to});
  return PathOutcome::found;
}

PathOutcome way_to_objects(PathPlanner* planner, const Place& from, std::span<const Place> objects, double reach_m,
                           std::vector<Place>& way) {
  if (reaches(from, objects, reach_m)) {
    way.assign({from, from});
    return PathOutcome::found;
  }
  const Disc disc = enclosing(objects);
  if (disc.radius_m > reach_m) return PathOutcome::no_way;
  if (planner != nullptr) {
    const PathOutcome outcome = planner->plan_near(from, objects, reach_m, way);
    if (outcome == PathOutcome::found) end_within_reach(objects, reach_m, way);
    // Where no cell's middle lies in so small an overlap, its own middle does.
    return outcome == PathOutcome::no_way ? planner->plan(from, disc.middle, 0, way) : outcome;
  }
  const double left_m = distance_m(disc.middle, from), stop_m = std::min(left_m, reach_m - disc.radius_m);
  const double share = left_m > 0 ? stop_m / left_m : 0;
  way.assign({from, between(disc.middle, from, share)});
  return PathOutcome::found;
}

double direction_to(const Place& from, std::span<const Place> objects) {
  const Place middle = enclosing(objects).middle;
  return std::atan2(middle.y_m - from.y_m, middle.x_m - from.x_m);
}

double Rehearsal::seconds(const PlanarPose& from, std::span<const Place> way, std::optional<double> direction_rad) {
  pilot_.halt();
  if (!pilot_.drive_to(way, direction_rad)) return kLongest_s;
  PlanarPose robot = from;
  std::array<navigation::Velocity, kLate> on_their_way{};
  double s = 0;
  for (size_t i = 0; s < kLongest_s && !pilot_.standing(); s += kStep_s, i = (i + 1) % kLate) {
    const navigation::Velocity now = std::exchange(on_their_way[i], pilot_.step(robot, kStep_s));
    robot = compose(robot, {now.speed_m_s * kStep_s, 0, now.turn_rad_s * kStep_s});
  }
  return s;
}

}  // namespace takt::robot_client
