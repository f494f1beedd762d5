// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "hal/base/base_messages.hpp"
#include "hal/base/wheel_odometry.hpp"
#include "hal/can/double_link.hpp"

namespace takt::base {

/// The mobile base as its host sees it on the bus: the messages of ace_base.dbc in their cycles, wheels that take their
/// time, the watchdog of 200 ms. Booted it stands, and counts from elsewhere.
class BaseDouble final : public can::NodeDouble {
 public:
  static constexpr int64_t kCommandStale_ns = 200'000'000;

  BaseDouble(std::string interface, const Clock& clock, uint64_t seed = 1);

  void press_emergency_stop(bool pressed) { emergency_stop_ = pressed; }
  void hit_bumper(bool hit) { bumper_ = hit; }
  void fail() { state_ = State::fault; }

  double speed_m_s() const { return speed_m_s_; }
  double turn_rad_s() const { return turn_rad_s_; }
  State state() const { return state_; }

 private:
  void forget() override;
  void take(const can::Incoming& incoming) override;
  void step() override;
  void take_command(std::span<const double> values);
  void send_due();

  WheelGeometry wheels_;
  int64_t command_ns_ = 0;
  State state_ = State::not_ready;
  bool emergency_stop_ = false, bumper_ = false, stale_ = true;
  double wanted_m_s_ = 0, wanted_rad_s_ = 0, asked_acceleration_m_s2_ = 0;
  double speed_m_s_ = 0, turn_rad_s_ = 0;
  std::array<double, 2> way_m_{};  ///< of the left and the right wheel since the counters were 0
};

}  // namespace takt::base
