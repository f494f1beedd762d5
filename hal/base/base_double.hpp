// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "hal/base/base_messages.hpp"
#include "hal/base/wheel_odometry.hpp"
#include "hal/can/double_link.hpp"

namespace takt::base {

/// The mobile base as its host sees it on the bus: the messages of ace_base.dbc in their cycles, wheels that take their
/// time, the watchdog of 200 ms. It lives in steps of 10 ms of the given clock's time. One thread.
class BaseDouble {
 public:
  static constexpr int64_t kStep_ns = 10'000'000;
  static constexpr int64_t kCommandStale_ns = 200'000'000;

  BaseDouble(std::string interface, const Clock& clock, uint64_t seed = 1);
  /// 0 or an errno. Powered at `now_ns`: says boot-up and then waits for a start.
  int open(int64_t now_ns);
  void close() { link_.close(); }
  /// Lives on until `now_ns`: takes what the host sent and sends what is due.
  void run_until(int64_t now_ns);

  void misbehave(can::Misbehaviour how) { link_.misbehave(how); }
  void press_emergency_stop(bool pressed) { emergency_stop_ = pressed; }
  void hit_bumper(bool hit) { bumper_ = hit; }
  void fail() { state_ = State::fault; }
  /// Power off and on: it stands, and counts from elsewhere.
  void reboot();

  double speed_m_s() const { return speed_m_s_; }
  double turn_rad_s() const { return turn_rad_s_; }
  State state() const { return state_; }
  const can::Station& station() const { return link_.station(); }

 private:
  void take_all();
  void take_command(std::span<const double> values);
  void step();
  void send_due();

  can::DoubleLink link_;
  WheelGeometry wheels_;
  int64_t now_ns_ = 0, command_ns_ = 0;
  State state_ = State::not_ready;
  bool emergency_stop_ = false, bumper_ = false, stale_ = true;
  double wanted_m_s_ = 0, wanted_rad_s_ = 0, asked_acceleration_m_s2_ = 0;
  double speed_m_s_ = 0, turn_rad_s_ = 0;
  std::array<double, 2> way_m_{};  ///< of the left and the right wheel since the counters were 0
};

}  // namespace takt::base
