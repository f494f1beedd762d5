// SPDX-License-Identifier: Apache-2.0
#include "hal/head/head_double.hpp"

#include <utility>

namespace takt::head {
namespace {

constexpr Axis kAxes[2] = {{120 * kDegree, 200 * kDegree, 1000 * kDegree},
                           {45 * kDegree, 150 * kDegree, 1000 * kDegree}};
constexpr double kStep_s = static_cast<double>(can::NodeDouble::kStep_ns) * 1e-9;
constexpr double kStartsAt_rad[2] = {7 * kDegree, -4 * kDegree};  // where it stood when the power came
constexpr int64_t kMs = 1'000'000;

/// From `from` to `to` within `time_ms`.
double moved(double from, double to, double elapsed_ms, double time_ms) {
  return elapsed_ms >= time_ms ? to : from + (to - from) * elapsed_ms / time_ms;
}

}  // namespace

void move_axes(const std::optional<std::array<double, 2>>& target_rad, const std::array<Axis, 2>& bounds, int64_t,
               Axes& axes) {
  for (size_t i = 0; i < 2; ++i) {
    double &position = axes.position_rad[i], &speed = axes.speed_rad_s[i];
    if (target_rad) {
      step_axis(bounds[i], (*target_rad)[i], kStep_s, position, speed);
    } else {  // brakes as hard as it can
      position = std::clamp(position + speed * kStep_s, -bounds[i].reach_rad, bounds[i].reach_rad);
      speed = towards(speed, 0, kAxes[i].acceleration_rad_s2 * kStep_s);
    }
  }
}

HeadDouble::HeadDouble(std::string interface, const Clock& clock, Neck neck, uint64_t seed)
    : NodeDouble(std::move(interface), clock, messages(), kPlaces, seed), neck_(std::move(neck)) {}

void HeadDouble::forget() {
  state_ = State::switch_on_disabled;
  mode_ = Mode::disable;
  homed_ = fault_ = stale_ = false;
  emergency_ = 0;
  setpoint_ns_ = now_ns();
  axes_ = {{kStartsAt_rad[0], kStartsAt_rad[1]}, {}};
  lids_ = {};
}

void HeadDouble::take(const can::Incoming& incoming) {
  if (incoming.message == kSetpoint) take_setpoint(incoming.values);
  if (incoming.message == kEyelidSetpoint) take_eyelids(incoming.values);
}

void HeadDouble::take_setpoint(std::span<const double> values) {
  setpoint_ns_ = now_ns();
  stale_ = false;
  mode_ = static_cast<Mode>(values[Setpoint::mode]);
  if (mode_ == Mode::fault_reset) {
    fault_ = false;
    if (state_ == State::fault) state_ = State::switch_on_disabled;
    if (emergency_ != 0) say_emergency(0);
  }
  asked_speed_rad_s_ = values[Setpoint::speed] * kDegree;
  asked_acceleration_rad_s2_ = values[Setpoint::acceleration] * kDegree;
  const std::array asked{values[Setpoint::pan] * kDegree, values[Setpoint::tilt] * kDegree};
  if (mode_ == Mode::quick_stop) state_ = State::quick_stop;
  if (mode_ == Mode::disable || !may_move()) {
    if (!fault_) state_ = State::switch_on_disabled;
    return;
  }
  if (mode_ == Mode::position && state_ != State::operation_enabled) {
    // Only where it stands: it would jump. A tick of motion may lie between what the host saw and now.
    const bool jumps =
        std::abs(asked[0] - axes_.position_rad[0]) > kDegree || std::abs(asked[1] - axes_.position_rad[1]) > kDegree;
    if (homed_ && !jumps) state_ = State::operation_enabled;
  }
  if (mode_ == Mode::position && state_ == State::operation_enabled) target_rad_ = asked;
}

void HeadDouble::take_eyelids(std::span<const double> values) {
  const auto token = static_cast<uint8_t>(values[EyelidSetpoint::token]);
  if (token == lids_.token) return;
  lids_.token = token;
  lids_.action = static_cast<EyelidAction>(values[EyelidSetpoint::action]);
  std::copy(values.begin(), values.end(), lids_.told.begin());
  lids_.since_ns = now_ns();
  lids_.from_left = lids_.left;
  lids_.from_right = lids_.right;
  lids_.moving = lids_.action != EyelidAction::hold && lids_.action != EyelidAction::relax;
}

void HeadDouble::step() {
  watch();
  move();
  move_lids();
  send_due();
}

void HeadDouble::watch() {
  if (!link().operational()) return;
  if (link().deserted(now_ns())) {
    if (emergency_ == 0) say_emergency(kHeartbeatLost);
  } else if (emergency_ == kHeartbeatLost) {
    say_emergency(0);
  }
  const bool late = now_ns() - setpoint_ns_ > kSetpointStale_ns;
  if (state_ == State::operation_enabled && (late || emergency_ != 0)) {
    state_ = State::quick_stop;
    stale_ = late;
  }
  if (emergency_stop_ && !fault_) state_ = State::switch_on_disabled;
}

void HeadDouble::move() {
  const bool homes = mode_ == Mode::home && !homed_ && may_move() && now_ns() - setpoint_ns_ <= kSetpointStale_ns;
  const bool follows = !homes && state_ == State::operation_enabled && mode_ == Mode::position;
  std::array bounds{kAxes[0], kAxes[1]};
  for (Axis& axis : bounds) {
    if (asked_speed_rad_s_ > 0) axis.speed_rad_s = std::min(axis.speed_rad_s, asked_speed_rad_s_);
    if (asked_acceleration_rad_s2_ > 0)
      axis.acceleration_rad_s2 = std::min(axis.acceleration_rad_s2, asked_acceleration_rad_s2_);
  }
  if (homes) target_rad_ = {};
  neck_(homes || follows ? std::optional(target_rad_) : std::nullopt, bounds, now_ns(), axes_);
  if (homes) homed_ = axes_.position_rad == target_rad_;
  else if (!follows) target_rad_ = axes_.position_rad;
}

void HeadDouble::move_lids() {
  if (!lids_.moving) return;
  const auto& told = lids_.told;
  const double elapsed_ms = static_cast<double>(now_ns() - lids_.since_ns) * 1e-6;
  const double move_ms = told[EyelidSetpoint::move_ms], hold_ms = told[EyelidSetpoint::hold_ms];
  if (lids_.action == EyelidAction::position) {
    lids_.left = moved(lids_.from_left, told[EyelidSetpoint::left], elapsed_ms, move_ms);
    lids_.right = moved(lids_.from_right, told[EyelidSetpoint::right], elapsed_ms, move_ms);
    lids_.moving = elapsed_ms < move_ms;
    return;
  }
  // A blink: there, a while, and back.
  const double whole_ms = 2 * move_ms + hold_ms;
  const bool back = elapsed_ms > move_ms + hold_ms;
  const auto lid = [&](double& position, double from, double to) {
    position = back ? moved(to, from, elapsed_ms - move_ms - hold_ms, move_ms) : moved(from, to, elapsed_ms, move_ms);
  };
  if (lids_.action != EyelidAction::wink_right) lid(lids_.left, lids_.from_left, told[EyelidSetpoint::left]);
  if (lids_.action != EyelidAction::wink_left) lid(lids_.right, lids_.from_right, told[EyelidSetpoint::right]);
  if (elapsed_ms < whole_ms) return;
  ++lids_.blinks;
  lids_.since_ns = now_ns();
  lids_.moving = --lids_.told[EyelidSetpoint::repeat] > 0;
}

void HeadDouble::send_due() {
  // A head that nobody has started says no more than that it lives.
  link().beat(now_ns());
  if (!link().operational()) return;
  const double sample_ms = std::fmod(static_cast<double>(link().uptime_ns(now_ns())) * 1e-6, 6553.6);
  link().send(kVelStatus, std::array{axes_.speed_rad_s[0] / kDegree, axes_.speed_rad_s[1] / kDegree, sample_ms});
  send_status();
  if (link().due(now_ns(), 50 * kMs)) {
    const auto state = lids_jammed_                             ? EyelidState::stalled
                       : !lids_.moving                          ? EyelidState::idle
                       : lids_.action == EyelidAction::position ? EyelidState::moving
                                                                : EyelidState::blinking;
    const double current_mA = lids_.moving ? 350 : 20;
    link().send(kEyelidStatus, std::array{static_cast<double>(state), lids_.left, lids_.right, current_mA, current_mA,
                                          6.0, static_cast<double>(lids_.blinks)});
  }
  if (link().due(now_ns(), 500 * kMs)) {
    const double uptime_s = std::floor(static_cast<double>(link().uptime_ns(now_ns())) * 1e-9);
    link().send(kHealth, std::array{temperature_degC_, temperature_degC_ - 3, supply_V_, 1.7, uptime_s});
  }
  if (link().due(now_ns(), 1000 * kMs)) {
    std::array<double, Limits::count> limits{};
    limits[Limits::page] = std::exchange(page_, (page_ + 1) % 3);
    limits[Limits::pan_low] = -kAxes[0].reach_rad / kDegree;
    limits[Limits::pan_high] = kAxes[0].reach_rad / kDegree;
    limits[Limits::tilt_low] = -kAxes[1].reach_rad / kDegree;
    limits[Limits::tilt_high] = kAxes[1].reach_rad / kDegree;
    limits[Limits::pan_margin] = limits[Limits::tilt_margin] = 2;
    limits[Limits::pan_speed] = kAxes[0].speed_rad_s / kDegree;
    limits[Limits::tilt_speed] = kAxes[1].speed_rad_s / kDegree;
    limits[Limits::acceleration] = kAxes[0].acceleration_rad_s2 / kDegree;
    link().send(kLimits, limits);
  }
}

void HeadDouble::send_status() {
  const auto flag = [](bool on) { return on ? 1.0 : 0.0; };
  const auto reached = [&](size_t i) {
    return flag(axes_.position_rad[i] == target_rad_[i] && axes_.speed_rad_s[i] == 0);
  };
  const bool powered = state_ == State::operation_enabled || state_ == State::quick_stop || mode_ == Mode::home;
  std::array<double, PosStatus::count> status{};
  status[PosStatus::state] = static_cast<double>(state_);
  status[PosStatus::pan] = axes_.position_rad[0] / kDegree;
  status[PosStatus::tilt] = axes_.position_rad[1] / kDegree;
  status[PosStatus::pan_reached] = reached(0);
  status[PosStatus::tilt_reached] = reached(1);
  status[PosStatus::pan_homed] = status[PosStatus::tilt_homed] = flag(homed_);
  status[PosStatus::pan_at_low] = flag(axes_.position_rad[0] <= -kAxes[0].reach_rad);
  status[PosStatus::pan_at_high] = flag(axes_.position_rad[0] >= kAxes[0].reach_rad);
  status[PosStatus::tilt_at_low] = flag(axes_.position_rad[1] <= -kAxes[1].reach_rad);
  status[PosStatus::tilt_at_high] = flag(axes_.position_rad[1] >= kAxes[1].reach_rad);
  status[PosStatus::emergency_stop] = flag(emergency_stop_);
  status[PosStatus::servo_power] = flag(powered && !emergency_stop_);
  status[PosStatus::brake] = flag(!powered || emergency_stop_);
  status[PosStatus::setpoint_stale] = flag(stale_);
  status[PosStatus::following_error] = flag(fault_);
  status[PosStatus::fault] = flag(fault_);
  link().send(kPosStatus, status);
}

void HeadDouble::fail(uint16_t code) {
  fault_ = true;
  state_ = State::fault;
  say_emergency(code);
}

void HeadDouble::say_emergency(uint16_t code) {
  emergency_ = code;
  const double axis = code == kFollowingError ? 1 : 0;  // pan; else the whole node
  link().send(kEmergency, std::array{static_cast<double>(code), code == 0 ? 0.0 : 17.0, axis, 0.0});
}

}  // namespace takt::head
