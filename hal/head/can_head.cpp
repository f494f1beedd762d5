// SPDX-License-Identifier: Apache-2.0
#include "hal/head/can_head.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace takt::head {
namespace {

constexpr double kHomingSpeed_deg_s = 30, kHomingAcceleration_deg_s2 = 200;
constexpr double kLidTime_ms = 400, kClosed_percent = 100;

/// Ours, as the head's messages are: what its servos and its supply of 24 V bear.
constexpr double kHot_degC = 70, kLowSupply_V = 20.4;
/// An axis that is farther from its set-point has to move.
constexpr double kThere_deg = 1;

bool is_on(double signal) { return signal != 0; }

}  // namespace

HeadRequest next_request(const HeadView& view, const std::optional<HeadAngles>& target) {
  if (!view.known || view.emergency_stop || view.fault || view.emergency != 0) return {};
  if (!view.homed) return {Mode::home, {}};
  if (view.state != State::operation_enabled) return {Mode::position, {view.pan_deg, view.tilt_deg}};
  return target ? HeadRequest{Mode::position, *target} : HeadRequest{Mode::hold, {}};
}

CanHead::CanHead(std::string id, CanHeadSettings settings, const Clock& clock)
    : HostDriver(std::move(id), settings.interface, clock, messages(), kPlaces, kStatusCycle_ns),
      settings_(std::move(settings)),
      limits_(settings_.limits) {}

void CanHead::forget() {
  view_ = {};
  target_.reset();
  sent_.reset();
  stuck_.forget();
  lids_told_.reset();
}

const char* CanHead::trouble() const {
  const char* of_bus = HostDriver::trouble();
  if (*of_bus != 0) return of_bus;
  if (stuck_.stuck()) return "the head does not move although it has to";
  return *health_ != 0 ? health_ : lids_stuck_ ? "the head says that an eyelid is stuck" : "";
}

void CanHead::take_health(std::span<const double> values) {
  health_ = std::max(values[Health::pan_degC], values[Health::tilt_degC]) > kHot_degC ? "the head is too hot"
            : values[Health::volts] < kLowSupply_V                                    ? "the head's supply is low"
                                                                                      : "";
}

void CanHead::rest() {
  send(HeadRequest{});
  if (settings_.eyelids) send_lids({true, true});
}

void CanHead::take(const can::Incoming& incoming) {
  const auto& values = incoming.values;
  switch (incoming.message) {
    case kPosStatus: return take_status(incoming);
    case kVelStatus:
      pan_rad_s_ = values[VelStatus::pan] * kDegree;
      tilt_rad_s_ = values[VelStatus::tilt] * kDegree;
      return;
    case kLimits: return narrow(values);
    case kHealth: return take_health(values);
    case kEyelidStatus: {
      const auto state = static_cast<EyelidState>(values[EyelidStatus::state]);
      lids_stuck_ = state == EyelidState::stalled || state == EyelidState::fault;
      return;
    }
    case kEmergency: view_.emergency = static_cast<uint16_t>(values[Emergency::code]); return;
    default: return;
  }
}

void CanHead::take_status(const can::Incoming& incoming) {
  const auto& values = incoming.values;
  view_.known = true;
  view_.state = static_cast<State>(values[PosStatus::state]);
  view_.homed = is_on(values[PosStatus::pan_homed]) && is_on(values[PosStatus::tilt_homed]);
  view_.emergency_stop = is_on(values[PosStatus::emergency_stop]);
  view_.fault = is_on(values[PosStatus::fault]);
  const bool moved = view_.pan_deg != values[PosStatus::pan] || view_.tilt_deg != values[PosStatus::tilt];
  view_.pan_deg = values[PosStatus::pan];
  view_.tilt_deg = values[PosStatus::tilt];
  HeadReading reading;
  reading.status = ReadStatus::ok;
  reading.stamp_ns = incoming.stamp_ns;
  reading.pan_rad = view_.pan_deg * kDegree;
  reading.tilt_rad = view_.tilt_deg * kDegree;
  reading.pan_rad_s = pan_rad_s_;
  reading.tilt_rad_s = tilt_rad_s_;
  const bool away = sent_ && std::max(std::abs(sent_->pan_deg - view_.pan_deg),
                                      std::abs(sent_->tilt_deg - view_.tilt_deg)) > kThere_deg;
  stuck_.observe(away && view_.state == State::operation_enabled, moved, incoming.stamp_ns);
  reading.repeated = stuck_.stuck();
  reading.moving = !is_on(values[PosStatus::pan_reached]) || !is_on(values[PosStatus::tilt_reached]);
  keep(reading);
}

void CanHead::narrow(std::span<const double> values) {
  const auto least = [&](double& limit, double said_deg) { limit = std::min(limit, said_deg * kDegree); };
  const auto reach = [&](double& limit, double low, double high, double margin) {
    least(limit, std::min(-low, high) - margin);
  };
  switch (static_cast<int>(values[Limits::page])) {
    case 0:
      return reach(limits_.pan_rad, values[Limits::pan_low], values[Limits::pan_high], values[Limits::pan_margin]);
    case 1:
      return reach(limits_.tilt_rad, values[Limits::tilt_low], values[Limits::tilt_high], values[Limits::tilt_margin]);
    default:
      least(limits_.pan_rad_s, values[Limits::pan_speed]);
      least(limits_.tilt_rad_s, values[Limits::tilt_speed]);
      least(limits_.acceleration_rad_s2, values[Limits::acceleration]);
  }
}

HeadReading CanHead::read(int64_t wanted_ns, int64_t) {
  if (!started()) return {};
  attend();
  const HeadRequest request = next_request(view_, target_);
  send(request);
  sent_ = request.mode == Mode::position ? std::optional(request.angles) : std::nullopt;
  target_.reset();
  if (settings_.eyelids) send_lids(std::exchange(lids_, {}));
  return newest(wanted_ns);
}

bool CanHead::command(double pan_rad, double tilt_rad, int64_t) {
  if (!started() || !std::isfinite(pan_rad) || !std::isfinite(tilt_rad)) return false;
  const double pan = std::clamp(pan_rad, -limits_.pan_rad, limits_.pan_rad),
               tilt = std::clamp(tilt_rad, -limits_.tilt_rad, limits_.tilt_rad);
  target_ = HeadAngles{pan / kDegree, tilt / kDegree};
  return pan == pan_rad && tilt == tilt_rad && next_request(view_, target_).mode == Mode::position &&
         view_.state == State::operation_enabled;
}

void CanHead::close_lids(bool left, bool right, int64_t) { lids_ = {left, right}; }

void CanHead::send(const HeadRequest& request) {
  std::array<double, Setpoint::count> values{};
  values[Setpoint::mode] = static_cast<double>(request.mode);
  values[Setpoint::pan] = request.angles.pan_deg;
  values[Setpoint::tilt] = request.angles.tilt_deg;
  if (request.mode == Mode::home) {
    values[Setpoint::speed] = kHomingSpeed_deg_s;
    values[Setpoint::acceleration] = kHomingAcceleration_deg_s2;
  } else if (request.mode == Mode::position) {
    // One bound for both axes; the head keeps each axis to its own. Rounded down: never faster than the limits.
    values[Setpoint::speed] = std::floor(limits_.pan_rad_s / kDegree + 1e-9);
    values[Setpoint::acceleration] = 10 * std::floor(limits_.acceleration_rad_s2 / kDegree / 10 + 1e-9);
  }
  bus().send(kSetpoint, values);
}

void CanHead::send_lids(const Lids& closed) {
  if (lids_told_ != closed) {
    lids_told_ = closed;
    lid_token_ = static_cast<uint8_t>((lid_token_ + 1) % 16);  // the same token again moves nothing twice
  }
  std::array<double, EyelidSetpoint::count> values{};
  values[EyelidSetpoint::action] = static_cast<double>(EyelidAction::position);
  values[EyelidSetpoint::left] = closed.left_closed ? kClosed_percent : 0;
  values[EyelidSetpoint::right] = closed.right_closed ? kClosed_percent : 0;
  values[EyelidSetpoint::move_ms] = kLidTime_ms;
  values[EyelidSetpoint::token] = lid_token_;
  bus().send(kEyelidSetpoint, values);
}

}  // namespace takt::head
