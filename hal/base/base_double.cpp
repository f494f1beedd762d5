// SPDX-License-Identifier: Apache-2.0
#include "hal/base/base_double.hpp"

#include <cmath>

#include "hal/motion.hpp"

namespace takt::base {
namespace {

constexpr double kSpeed_m_s = 1.4, kAcceleration_m_s2 = 1.35;        // devices.md 5
constexpr double kTurn_rad_s = 1.2, kTurnAcceleration_rad_s2 = 2.5;  // as the simulated base
constexpr double kStep_s = static_cast<double>(can::NodeDouble::kStep_ns) * 1e-9;
/// Where the counters stand when the power comes: soon they wrap.
constexpr uint32_t kFirstCounts[2] = {kWheelCounts - 100, 12345};

}  // namespace

BaseDouble::BaseDouble(std::string interface, const Clock& clock, uint64_t seed)
    : NodeDouble(std::move(interface), clock, messages(), kPlaces, seed) {}

void BaseDouble::forget() {
  command_ns_ = now_ns();
  state_ = State::disabled;
  stale_ = true;
  wanted_m_s_ = wanted_rad_s_ = speed_m_s_ = turn_rad_s_ = 0;
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
  wanted_m_s_ = std::clamp(values[Command::speed_m_s], -kSpeed_m_s, kSpeed_m_s);
  wanted_rad_s_ = std::clamp(values[Command::turn_rad_s], -kTurn_rad_s, kTurn_rad_s);
  asked_acceleration_m_s2_ = values[Command::acceleration_m_s2];
}

void BaseDouble::step() {
  const bool deserted = link().deserted(now_ns()) || !link().operational();
  if (now_ns() - command_ns_ > kCommandStale_ns) stale_ = true;
  const bool drives = !stale_ && !deserted && !emergency_stop_ && !bumper_ && state_ != State::fault;
  if (state_ != State::fault) state_ = drives ? State::enabled : State::disabled;
  const double acceleration =
      asked_acceleration_m_s2_ > 0 ? std::min(asked_acceleration_m_s2_, kAcceleration_m_s2) : kAcceleration_m_s2;
  speed_m_s_ = towards(speed_m_s_, drives ? wanted_m_s_ : 0, acceleration * kStep_s);
  turn_rad_s_ = towards(turn_rad_s_, drives ? wanted_rad_s_ : 0, kTurnAcceleration_rad_s2 * kStep_s);
  const double outward = turn_rad_s_ * wheels_.track_m / 2;
  way_m_[0] += (speed_m_s_ - outward) * kStep_s;
  way_m_[1] += (speed_m_s_ + outward) * kStep_s;
  send_due();
}

void BaseDouble::send_due() {
  link().beat(now_ns());
  if (!link().operational()) return;
  const auto flag = [](bool on) { return on ? 1.0 : 0.0; };
  const double sample_ms = std::fmod(static_cast<double>(link().uptime_ns(now_ns())) * 1e-6, 6553.6);
  link().send(kMotion, std::array{flag(emergency_stop_), flag(bumper_), flag(stale_), flag(state_ == State::fault),
                                  speed_m_s_, turn_rad_s_, sample_ms});
  const auto counted = [&](double way_m) {
    return static_cast<double>(static_cast<uint32_t>(std::llround(way_m / wheels_.step_m)) % kWheelCounts);
  };
  link().send(kWheels, std::array{static_cast<double>(state_), counted(way_m_[0]), counted(way_m_[1])});
}

}  // namespace takt::base
