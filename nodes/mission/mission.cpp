// SPDX-License-Identifier: Apache-2.0
#include "nodes/mission/mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "nodes/mission/pointing.hpp"

namespace takt::mission {
namespace {

constexpr double kStands_m_s = 0.02, kGotOn_m = 0.3;

constexpr double kLooksThere_rad = 0.35, kLookOn_rad = 1.0, kAllAround_rad = 2 * std::numbers::pi;
constexpr std::array kLeaderLooks_rad{0.7, -1.4, 2.1, -2.8, 1.4};  // left, right, farther left, right, ahead

constexpr std::array<std::string_view, 12> kStates{"seek", "look",  "ask",  "back",   "read", "confirm",
                                                   "turn", "drive", "face", "follow", "done", "failed"};

/// What the screen has for directions, seen by whoever stands behind the robot and looks where it looks.
struct Touched {
  std::string_view answer, words;
  double left_rad;
};
constexpr std::array<Touched, kMostTouched> kTouched{{{"left", "to the left", std::numbers::pi / 2},
                                                      {"ahead", "straight on", 0},
                                                      {"right", "to the right", -std::numbers::pi / 2}}};

template <class To>  // a pose or a place
double distance_m(const PlanarPose& from, const To& to) {
  return std::hypot(from.x_m - to.x_m, from.y_m - to.y_m);
}

}  // namespace

std::string_view to_string(State state) { return kStates[static_cast<size_t>(state)]; }

drive_arbiter::VisionState vision_of(State state) {
  using drive_arbiter::VisionState;
  if (state == State::read) return VisionState::pose;
  return state == State::follow ? VisionState::tracking : VisionState::search;
}

Mission::Mission(const MissionParameters& parameters, const WayAheadParameters& ways, size_t most_cells)
    : ways_(most_cells, ways) {
  tune(parameters, ways);
}

void Mission::tune(const MissionParameters& parameters, const WayAheadParameters& ways) {
  parameters_ = parameters;
  parameters_.readings = std::clamp<size_t>(parameters_.readings, 1, kMostReadings);
  ways_.tune(ways);
}

void Mission::enter(State state) {
  state_ = state;
  entered_ns_ = now_ns_;
  standing_ns_ = -1;
}

void Mission::fail(std::string_view trouble) {
  trouble_size_ = trouble.copy(trouble_.data(), trouble_.size());
  tell("stop");
  say("I cannot go on: {}", trouble);
  enter(State::failed);
}

template <class... Values>
void Mission::tell(const char* format, const Values&... values) {
  ++number_;
  size_ = std::min(text_.size(), fmt::format_to_n(text_.data(), text_.size(), fmt::runtime(format), values...).size);
}

template <class... Values>
void Mission::say(const char* format, const Values&... values) {
  speech_size_ =
      std::min(speech_.size(), fmt::format_to_n(speech_.data(), speech_.size(), fmt::runtime(format), values...).size);
}

void Mission::step(const Percept& percept) {
  now_ns_ = percept.now_ns;
  speech_size_ = 0;
  const bool over = percept.over == number_;
  if (!percept.pedestrian.empty()) pedestrian_ = percept.pedestrian_at;
  if (!percept.answer.empty() && answered(percept)) return;
  switch (state_) {
    case State::seek: return seek(percept);
    case State::look:
      if (over) enter(State::seek);
      return;
    case State::ask:
      if (!over) return;
      // Whoever was not got to is far enough already, and behind the robot there are no eyes.
      if (const double back_m = parameters_.view_m - distance_m(percept.robot, percept.pedestrian_at);
          !percept.pedestrian.empty() && back_m > 0)
        tell("ahead {:.2f}", -back_m);
      return enter(State::back);
    case State::back:
      if (!over) return;
      read_ = 0;
      say("Which way do I go, please?");
      return enter(State::read);
    case State::read: return read(percept);
    case State::confirm: return confirm(percept);
    case State::turn:
      if (!over) return;
      began_ = percept.robot;
      farthest_m_ = 0;
      got_on_ns_ = now_ns_;
      return enter(State::drive);
    case State::drive: return drive(percept, over);
    case State::face:
      if (!over) return;
      if (leader_looks_ == 0) began_ = percept.robot;
      leader_ns_ = now_ns_;
      return enter(State::follow);
    case State::follow: return follow(percept);
    case State::done:
    case State::failed: return;
  }
}

/// Who is out of sight may be where one was seen last, or anywhere.
void Mission::seek(const Percept& percept) {
  if (!percept.pedestrian.empty()) {
    tell("do ask {}", percept.pedestrian);
    return enter(State::ask);
  }
  if (since_s(entered_ns_) < parameters_.look_after_s) return;
  double turn_rad = kLookOn_rad;
  if (pedestrian_) {
    const double to_rad = std::atan2(pedestrian_->y_m - percept.robot.y_m, pedestrian_->x_m - percept.robot.x_m);
    const double there_rad = wrapped(to_rad - percept.robot.theta_rad);
    if (std::abs(there_rad) > kLooksThere_rad) turn_rad = there_rad;
    pedestrian_.reset();
  }
  tell("rotate {:.3f}", turn_rad);
  enter(State::look);
}

/// Whoever touches the screen need not be seen. Where the robot is led or has a way, only `stop` counts.
bool Mission::answered(const Percept& percept) {
  if (percept.answer == "stop" && state_ != State::done && state_ != State::failed) {
    fail("told to stop at the screen");
    return true;
  }
  const auto* touched = std::ranges::find(kTouched, percept.answer, &Touched::answer);
  if (touched == kTouched.end() || (state_ > State::confirm && state_ != State::failed)) return false;
  touched_ = static_cast<size_t>(touched - kTouched.begin());
  trouble_size_ = 0;
  tell("stop");
  say("Do I go {}?", touched->words);
  enter(State::confirm);
  return true;
}

void Mission::confirm(const Percept& percept) {
  const Touched& touched = kTouched[touched_];
  if (percept.answer == "yes") {
    direction_rad_ = wrapped(percept.robot.theta_rad + touched.left_rad);
    say("Thank you. I go {}.", touched.words);
    return turn_to_direction(percept.robot, State::turn);
  }
  if (percept.answer == "no") {
    read_ = 0;
    say("Which way, then?");
    return enter(State::read);
  }
  if (since_s(entered_ns_) >= parameters_.confirm_within_s) enter(State::seek);
}

void Mission::read(const Percept& percept) {
  if (percept.pointed_rad) readings_rad_[read_++] = *percept.pointed_rad;
  if (read_ >= parameters_.readings) {
    direction_rad_ = middle_direction(std::span(readings_rad_).first(read_));
    say("Thank you. I go there.");
    return turn_to_direction(percept.robot, State::turn);
  }
  if (since_s(entered_ns_) < parameters_.read_within_s) return;
  if (++asked_ >= parameters_.asking) return fail("nobody points the way");
  // The memory of what the ground looks like learns from what lies before the robot: all around there is more of it.
  tell("rotate {:.3f}", kAllAround_rad);
  enter(State::look);
}

void Mission::turn_to_direction(const PlanarPose& robot, State next) {
  tell("rotate {:.3f}", wrapped(*direction_rad_ - robot.theta_rad));
  enter(next);
}

/// Leg by leg along the direction, as far as the ground is free.
void Mission::drive(const Percept& percept, bool over) {
  const bool last = crossed_ == parameters_.crossings;
  if (last && distance_m(percept.robot, began_) >= parameters_.beyond_m) {
    tell("stop");
    say("I am there.");
    return enter(State::done);
  }
  // Seen now and then as the robot comes nearer, and not any more from close by.
  if (percept.sign) sign_ = percept.sign;
  if (!last && sign_) {
    const double sign_m = distance_m(percept.robot, *sign_);
    to_cross_m_ = sign_m + parameters_.cross_least_m;
    if (sign_m <= parameters_.stop_before_m) {
      waiting_ns_ = now_ns_;
      leader_looks_ = 0;
      say("Please lead me across. I follow a chessboard shirt.");
      return turn_to_direction(percept.robot, State::face);
    }
  }
  const double along = (percept.robot.x_m - began_.x_m) * std::cos(*direction_rad_) +
                       (percept.robot.y_m - began_.y_m) * std::sin(*direction_rad_);
  if (along > farthest_m_ + kGotOn_m) {
    farthest_m_ = along;
    got_on_ns_ = now_ns_;
  }
  if (since_s(got_on_ns_) > parameters_.patience_s) return fail("no free ground leads on");
  if (!over || percept.grid == nullptr) return;
  if (const auto place = ways_.next(*percept.grid, {percept.robot.x_m, percept.robot.y_m}, *direction_rad_))
    tell("drive {:.2f} {:.2f}", place->x_m, place->y_m);
}

void Mission::follow(const Percept& percept) {
  if (std::abs(percept.speed_m_s) > kStands_m_s) standing_ns_ = -1;
  else if (standing_ns_ < 0) standing_ns_ = now_ns_;
  const bool stood = standing_ns_ >= 0 && since_s(standing_ns_) >= parameters_.stand_s;
  if (stood && distance_m(percept.robot, began_) >= to_cross_m_) {
    ++crossed_;
    sign_.reset();
    return turn_to_direction(percept.robot, State::turn);  // who led it may have turned aside
  }
  if (since_s(waiting_ns_) > parameters_.follow_within_s) return fail("nobody leads across");
  if (percept.leader || standing_ns_ < 0) leader_ns_ = now_ns_;
  if (since_s(leader_ns_) <= parameters_.leader_after_s) return;
  // Who waits beside the robot, or has gone past it, is beyond the edge of its view.
  tell("rotate {:.3f}", kLeaderLooks_rad[leader_looks_++ % kLeaderLooks_rad.size()]);
  enter(State::face);
}

}  // namespace takt::mission
