// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <functional>

#include "hal/base/base_messages.hpp"
#include "hal/base/wheel_odometry.hpp"
#include "hal/can/double_link.hpp"

namespace takt::base {

/// What a base is to do: zero where it is to stand.
struct Drive {
  double speed_m_s = 0, turn_rad_s = 0;
  double acceleration_m_s2 = 0;  ///< at most
};

/// What a body does in one step.
struct Advance {
  double forward_m = 0, turn_rad = 0;    ///< within the step, as the wheels have it
  double speed_m_s = 0, turn_rad_s = 0;  ///< at its end
  bool blocked = false;                  ///< something stands in the way
};

/// What a double's wheels carry: moves for one step of NodeDouble::kStep_ns, which ends at `now_ns`.
using Body = std::function<Advance(const Drive& drive, int64_t now_ns)>;

/// A body of its own, that nothing stands in the way of.
Body free_body();

/// The mobile base as its host sees it on the bus: the messages of ace_base.dbc in their cycles, wheels that take their
/// time, the watchdog of 200 ms. Booted it stands, and counts from elsewhere.
class BaseDouble final : public can::NodeDouble {
 public:
  static constexpr int64_t kCommandStale_ns = 200'000'000;

  BaseDouble(std::string interface, const Clock& clock, Body body = free_body(), uint64_t seed = 1);

  void press_emergency_stop(bool pressed) { emergency_stop_ = pressed; }
  void hit_bumper(bool hit) { bumper_ = hit; }
  void fail() { state_ = State::fault; }

  double speed_m_s() const { return moved_.speed_m_s; }
  double turn_rad_s() const { return moved_.turn_rad_s; }
  State state() const { return state_; }

 private:
  void forget() override;
  void take(const can::Incoming& incoming) override;
  void step() override;
  void take_command(std::span<const double> values);
  void send_due();

  Body body_;
  WheelGeometry wheels_;
  int64_t command_ns_ = 0;
  State state_ = State::not_ready;
  bool emergency_stop_ = false, bumper_ = false, stale_ = true;
  Drive wanted_;
  Advance moved_;
  std::array<double, 2> way_m_{};  ///< of the left and the right wheel since the counters were 0
};

}  // namespace takt::base
