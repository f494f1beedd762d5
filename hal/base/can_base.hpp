// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "hal/base/base_messages.hpp"
#include "hal/base/mobile_base.hpp"
#include "hal/base/wheel_odometry.hpp"
#include "hal/can/host_driver.hpp"
#include "hal/can/stuck.hpp"

namespace takt::base {

struct CanBaseSettings {
  std::string interface;
  WheelGeometry wheels{};
  BaseLimits limits{1.4, 1.35, 1.2};  ///< D-5; the turn rate is our choice
};

/// The mobile base on a CAN bus. Odometry is counted here, from the wheels' encoders.
class CanBase final : public can::HostDriver<MobileBase, BaseReading> {
 public:
  CanBase(std::string id, CanBaseSettings settings, const Clock& clock);
  BaseLimits limits() const override { return settings_.limits; }
  BaseReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  const char* trouble() const override;
  /// Sent at once. False also while the base does not follow: emergency stop, bumper, not ready.
  bool command(double speed_m_s, double turn_rad_s, int64_t at_ns) override;

 private:
  void take(const can::Incoming& incoming) override;
  void forget() override;
  void rest() override { send(Mode::disable, 0, 0); }
  bool faulted() const override { return state_ == State::fault; }
  void reset_fault() override { send(Mode::fault_reset, 0, 0); }

  bool send(Mode mode, double speed_m_s, double turn_rad_s);
  bool follows() const;
  /// By what it was told a moment ago, or says itself.
  bool has_to_move(int64_t now_ns) const;

  CanBaseSettings settings_;
  WheelOdometry odometry_;
  std::array<double, Motion::count> motion_{};
  State state_ = State::not_ready;
  can::Stuck stuck_;
  std::array<double, 2> counts_{};  ///< of the wheels, as last heard
  double wanted_m_s_ = 0, wanted_rad_s_ = 0;
  int64_t wanted_until_ns_ = INT64_MIN;
};

}  // namespace takt::base
