// SPDX-License-Identifier: Apache-2.0
#include "hal/base/base_double.hpp"

#include <cmath>

#include "hal/motion.hpp"

namespace takt::base {
namespace {

constexpr double kSpeed_m_s = 1.4, kAcceleration_m_s2 = 1.35;        // D-5
constexpr double kTurn_rad_s = 1.2, kTurnAcceleration_rad_s2 = 2.5;  // as the simulated base
constexpr double kStep_s = static_cast<double>(can::NodeDouble::kStep_ns) * 1e-9;
/// Where the counters stand when the power comes: soon they wrap.
constexpr uint32_t kFirstCounts[2] = {kWheelCounts - 100, 12345};

}  // namespace

Body free_body() {
  return [speed = 0.0, turn = 0.0](const Drive& drive, int64_t) mutable {
    speed = towards(speed, drive.speed_m_s, drive.acceleration_m_s2 * kStep_s);
    turn = towards(turn, drive.turn_rad_s, kTurnAcceleration_rad_s2 * kStep_s);
    return Advance{speed * kStep_s, turn * kStep_s, speed, turn, false};
  };
}

BaseDouble::BaseDouble(std::string interface, const Clock& clock, Body body, uint64_t seed)
    : NodeDouble(std::move(interface), clock, messages(), kPlaces, seed), body_(std::move(body)) {}

void BaseDouble::forget() {
  command_ns_ = now_ns();
  state_ = State::disabled;
  stale_ = true;
  wanted_ = {0, 0, kAcceleration_m_s2};
  moved_ = {};
  for (size_t i = 0; i < 2; ++i) way_m_[i] = kFirstCounts[i] * wheels_.step_m;
}

void BaseDouble::take(const can::Incoming& incoming) {
  if (incoming.message == kCommand) take_command(incoming.values);
}

void BaseDouble::take_command(std::span<const double> values) {
  const auto mode = static_cast<Mode>(values[Command::mode]);
  if (mode == Mode::fault_reset && state_ == State::fault) state_ = State::disabled;
  if (mode != Mode::drive) {
    stale_ = true;
    return;
  }
  command_ns_ = now_ns();
  stale_ = false;
  const double asked_m_s2 = values[Command::acceleration_m_s2];
  wanted_ = {std::clamp(values[Command::speed_m_s], -kSpeed_m_s, kSpeed_m_s),
             std::clamp(values[Command::turn_rad_s], -kTurn_rad_s, kTurn_rad_s),
             asked_m_s2 > 0 ? std::min(asked_m_s2, kAcceleration_m_s2) : kAcceleration_m_s2};
}

void BaseDouble::step() {
  const bool deserted = link().deserted(now_ns()) || !link().operational();
  if (now_ns() - command_ns_ > kCommandStale_ns) stale_ = true;
  const bool drives = !stale_ && !deserted && !emergency_stop_ && !bumper_ && state_ != State::fault;
  if (state_ != State::fault) state_ = drives ? State::enabled : State::disabled;
  moved_ = body_(drives ? wanted_ : Drive{0, 0, wanted_.acceleration_m_s2}, now_ns());
  const double outward_m = moved_.turn_rad * wheels_.track_m / 2;
  way_m_[0] += moved_.forward_m - outward_m;
  way_m_[1] += moved_.forward_m + outward_m;
  send_due();
}

void BaseDouble::send_due() {
  link().beat(now_ns());
  if (!link().operational()) return;
  const auto flag = [](bool on) { return on ? 1.0 : 0.0; };
  const double sample_ms = std::fmod(static_cast<double>(link().uptime_ns(now_ns())) * 1e-6, 6553.6);
  link().send(kMotion, std::array{flag(emergency_stop_), flag(bumper_ || moved_.blocked), flag(stale_),
                                  flag(state_ == State::fault), moved_.speed_m_s, moved_.turn_rad_s, sample_ms});
  const auto counted = [&](double way_m) {
    return static_cast<double>(static_cast<uint32_t>(std::llround(way_m / wheels_.step_m)) % kWheelCounts);
  };
  link().send(kWheels, std::array{static_cast<double>(state_), counted(way_m_[0]), counted(way_m_[1])});
}

}  // namespace takt::base
