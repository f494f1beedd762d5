// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/driving.hpp"

#include <algorithm>

namespace takt::robot_client {
namespace {

constexpr std::string_view kObstacle = "an obstacle stands in the way";
constexpr double kDriven_m = 0.05, kTurned_rad = 0.05;  // less is no getting on
constexpr double kPassed_m = 0.2;                       // nearer to where it had to stand it is the same obstacle

Place place_of(const PlanarPose& robot) { return {robot.x_m, robot.y_m}; }

}  // namespace

Driving::Driving(const DrivingParameters& parameters)
    : parameters_(parameters), planner_(parameters.most_cells, parameters.path), pilot_(parameters.pilot) {
  way_.reserve(std::max<size_t>(2, parameters.most_cells));
  rest_.reserve(parameters.pilot.most_places + 1);
}

void Driving::tune(DrivingParameters parameters) {
  parameters.most_cells = parameters_.most_cells;
  parameters_ = parameters;
  planner_.tune(parameters.path);
  pilot_.tune(parameters.pilot);
}

bool Driving::look(const navigation::OccupancyView& grid) {
  if (!planner_.look(grid)) return false;
  seen_grid_ = new_grid_ = true;
  return true;
}

void Driving::begin(Kind kind) {
  pilot_.stand();
  kind_ = kind;
  progress_ = Progress::under_way;
  reason_.clear();
  begun_ = false;
  closed_s_ = standing_s_ = halted_s_ = 0;
  backs_ = 0;
  backing_.reset();
}

void Driving::to_place(const Place& place) {
  begin(Kind::place);
  targets_[0] = place;
  count_ = 1;
}
void Driving::to_objects(std::span<const Place> objects, double reach_m) {
  begin(Kind::objects);
  count_ = std::min(objects.size(), kMostTargets);
  std::copy_n(objects.begin(), count_, targets_.begin());
  reach_m_ = reach_m;
}
void Driving::to_unknown() { begin(Kind::unknown); }
void Driving::rotate(double by_rad) {
  begin(Kind::rotate);
  amount_ = by_rad;
}
void Driving::ahead(double by_m) {
  begin(Kind::ahead);
  amount_ = by_m;
}
void Driving::stand() {
  pilot_.stand();
  kind_ = Kind::none;
  progress_ = Progress::arrived;
}
void Driving::halt() {
  pilot_.halt();
  standing_s_ = 0;
}

navigation::Velocity Driving::halt_before_obstacle(const PlanarPose& robot, double dt_s) {
  halt();
  if (kind_ == Kind::none) return {};
  if (backing_) return draw_back(robot, dt_s);
  if (halted_s_ == 0) halted_at_ = robot;
  if ((halted_s_ += dt_s) < parameters_.wait_s) return {};
  if (backs_ == parameters_.most_backs) {
    fail(kObstacle);
    return {};
  }
  ++backs_;
  halted_s_ = 0;
  backing_ = robot;
  return draw_back(robot, dt_s);
}

/// Also while the stop lasts: who commands it has to see that the robot wants away from the obstacle.
navigation::Velocity Driving::draw_back(const PlanarPose& robot, double dt_s) {
  const PlanarPose moved = between(*backing_, robot);
  halted_s_ += dt_s;
  if (std::hypot(moved.x_m, moved.y_m) < parameters_.back_m && halted_s_ < parameters_.stuck_s)
    return {-parameters_.back_m_s, 0};
  backing_.reset();
  halted_s_ = standing_s_ = 0;
  if (has_way(kind_)) begun_ = false;
  return {};
}

void Driving::begin_exploring(const PlanarPose& robot) {
  area_ = {place_of(robot), parameters_.explore_far_m};
  explored_count_ = 0;
}

void Driving::fail(std::string_view reason) {
  if (kind_ == Kind::unknown && begun_) note_explored(way_.back());  // it need not try there again
  pilot_.stand();
  kind_ = Kind::none;
  progress_ = Progress::failed;
  reason_ = reason;
}

void Driving::note_explored(const Place& place) {
  explored_[explored_count_++ % explored_.size()] = {place, parameters_.explored_m};
}

PathOutcome Driving::find_way(const Place& from) {
  switch (kind_) {
    case Kind::place: return way_to_place(planner(), from, targets_[0], way_);
    case Kind::objects: return way_to_objects(planner(), from, targets(), reach_m_, way_);
    case Kind::unknown:
      if (!seen_grid_) return PathOutcome::start_outside;
      return planner_.plan_to_unknown(from, area_,
                                      std::span(explored_).first(std::min(explored_count_, explored_.size())), way_);
    default: return PathOutcome::no_way;
  }
}

bool Driving::way_is_free(const PlanarPose& robot) {
  const auto left = pilot_.way_left();
  if (!seen_grid_ || left.empty()) return true;
  rest_.assign({place_of(robot)});
  rest_.insert(rest_.end(), left.begin(), left.end());
  return planner_.free(rest_);
}

/// A way at the beginning, and another one where the newest grid closes it.
void Driving::keep_a_way(const PlanarPose& robot) {
  const bool driving = begun_ && pilot_.behaviour() == navigation::Behaviour::drive_to;
  if (begun_ && !(driving && new_grid_ && !way_is_free(robot))) return;
  if (closed_s_ > 0 && !new_grid_) return;  // nothing has opened since
  const PathOutcome outcome = find_way(place_of(robot));
  if (outcome == PathOutcome::found) {
    const bool looks = kind_ == Kind::objects;
    begun_ = pilot_.drive_to(way_, looks ? std::optional(direction_to(way_.back(), targets())) : std::nullopt);
    closed_s_ = 0;
    if (!begun_) fail("the way there has too many corners");
  } else if (kind_ == Kind::unknown) {
    fail("there is no grid here that says what is unknown");
    if (outcome == PathOutcome::no_way) progress_ = Progress::nothing_left;
  } else {
    begun_ = false;
    reason_ = navigation::to_string(outcome);
    pilot_.stand();
  }
}

void Driving::notice_standstill(const PlanarPose& robot, double dt_s) {
  const PlanarPose moved = between(got_on_, robot);
  const bool got_on = std::hypot(moved.x_m, moved.y_m) >= kDriven_m || std::abs(moved.theta_rad) >= kTurned_rad;
  if (got_on || standing_s_ == 0) got_on_ = robot;
  standing_s_ = got_on ? 0 : standing_s_ + dt_s;
  if (standing_s_ > parameters_.stuck_s) fail("the robot does not get on");
}

navigation::Velocity Driving::step(const PlanarPose& robot, double dt_s) {
  if (backing_) return draw_back(robot, dt_s);
  // A guard that lets go of who stands, and stops who moves, makes many short stops of one.
  const PlanarPose passed = between(halted_at_, robot);
  if (std::hypot(passed.x_m, passed.y_m) >= kPassed_m) halted_s_ = 0;
  if (has_way(kind_)) {
    keep_a_way(robot);
    if (kind_ != Kind::none && !begun_ && (closed_s_ += dt_s) > parameters_.patience_s) fail(reason_);
  } else if (kind_ != Kind::none && !begun_) {
    if (kind_ == Kind::rotate) pilot_.rotate(robot, amount_);
    else pilot_.straight_ahead(robot, amount_);
    begun_ = true;
  }
  new_grid_ = false;
  const navigation::Velocity velocity = pilot_.step(robot, dt_s);
  if (kind_ == Kind::none || !begun_) return velocity;
  notice_standstill(robot, dt_s);
  if (kind_ != Kind::none && pilot_.standing()) {
    progress_ = Progress::arrived;
    if (kind_ == Kind::unknown) note_explored(place_of(robot));
    kind_ = Kind::none;
  }
  return velocity;
}

double Driving::left_m(const PlanarPose& robot) const {
  double sum = 0;
  Place from = place_of(robot);
  for (const Place& to : pilot_.way_left()) {
    sum += std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
    from = to;
  }
  return sum;
}

}  // namespace takt::robot_client
