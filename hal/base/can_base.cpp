// SPDX-License-Identifier: Apache-2.0
#include "hal/base/can_base.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace takt::base {
namespace {

/// Slower is no motion that the wheels would have to show.
constexpr double kMoves_m_s = 0.05, kTurns_rad_s = 0.1;
/// How long a command holds: the base's own watchdog (D-5).
constexpr int64_t kCommandHolds_ns = 200'000'000;

/// The rim of the outer wheel at full speed in the tightest curve.
double fastest_wheel_m_s(const CanBaseSettings& settings) {
  return settings.limits.speed_m_s + settings.limits.turn_rad_s * settings.wheels.track_m / 2;
}

}  // namespace

CanBase::CanBase(std::string id, CanBaseSettings settings, const Clock& clock)
    : HostDriver(std::move(id), settings.interface, clock, messages(), kPlaces, kWheelsCycle_ns),
      settings_(std::move(settings)),
      odometry_(settings_.wheels, kWheelCounts, fastest_wheel_m_s(settings_)) {}

void CanBase::forget() {
  odometry_.forget();
  motion_ = {};
  state_ = State::not_ready;
  stuck_.forget();
}

const char* CanBase::trouble() const {
  const char* of_bus = HostDriver::trouble();
  return *of_bus == 0 && stuck_.stuck() ? "the wheels stand although the base has to move, or says so" : of_bus;
}

bool CanBase::has_to_move(int64_t now_ns) const {
  const auto moves = [](double speed_m_s, double turn_rad_s) {
    return std::abs(speed_m_s) > kMoves_m_s || std::abs(turn_rad_s) > kTurns_rad_s;
  };
  return moves(motion_[Motion::speed_m_s], motion_[Motion::turn_rad_s]) ||
         (now_ns < wanted_until_ns_ && follows() && moves(wanted_m_s_, wanted_rad_s_));
}

void CanBase::take(const can::Incoming& incoming) {
  const auto& values = incoming.values;
  if (incoming.message == kMotion) {
    std::copy(values.begin(), values.end(), motion_.begin());
  } else if (incoming.message == kWheels) {
    state_ = static_cast<State>(values[Wheels::state]);
    odometry_.observe(static_cast<uint32_t>(values[Wheels::left]), static_cast<uint32_t>(values[Wheels::right]),
                      incoming.stamp_ns);
    const PlanarPose& pose = odometry_.pose();
    const std::array counts{values[Wheels::left], values[Wheels::right]};
    stuck_.observe(has_to_move(incoming.stamp_ns), std::exchange(counts_, counts) != counts, incoming.stamp_ns);
    const bool blocked = motion_[Motion::bumper] != 0 || motion_[Motion::emergency_stop] != 0;
    keep({ReadStatus::ok, incoming.stamp_ns, pose.x_m, pose.y_m, pose.theta_rad, motion_[Motion::speed_m_s],
          motion_[Motion::turn_rad_s], odometry_.epoch(), blocked, stuck_.stuck()});
  }
}

BaseReading CanBase::read(int64_t wanted_ns, int64_t) {
  if (!started()) return {};
  attend();
  return newest(wanted_ns);
}

bool CanBase::follows() const {
  return (state_ == State::disabled || state_ == State::enabled) && motion_[Motion::emergency_stop] == 0 &&
         motion_[Motion::bumper] == 0;
}

bool CanBase::command(double speed_m_s, double turn_rad_s, int64_t at_ns) {
  if (!started() || !std::isfinite(speed_m_s) || !std::isfinite(turn_rad_s)) return false;
  const BaseLimits& limit = settings_.limits;
  const double speed = std::clamp(speed_m_s, -limit.speed_m_s, limit.speed_m_s),
               turn = std::clamp(turn_rad_s, -limit.turn_rad_s, limit.turn_rad_s);
  wanted_m_s_ = speed;
  wanted_rad_s_ = turn;
  wanted_until_ns_ = at_ns + kCommandHolds_ns;
  return send(Mode::drive, speed, turn) && speed == speed_m_s && turn == turn_rad_s && follows();
}

bool CanBase::send(Mode mode, double speed_m_s, double turn_rad_s) {
  return bus().send(kCommand,
                    std::array{static_cast<double>(mode), speed_m_s, turn_rad_s, settings_.limits.acceleration_m_s2});
}

}  // namespace takt::base
