// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

#include "hal/can/double_link.hpp"
#include "hal/head/head_messages.hpp"
#include "hal/motion.hpp"

namespace takt::head {

/// The axes of a head, pan and tilt.
struct Axes {
  std::array<double, 2> position_rad{}, speed_rad_s{};
};

/// What carries a double's axes: moves them for one step of NodeDouble::kStep_ns, which ends at `now_ns`, towards
/// `target_rad` within `bounds`, or has them brake where there is no target.
using Neck = std::function<void(const std::optional<std::array<double, 2>>& target_rad,
                                const std::array<Axis, 2>& bounds, int64_t now_ns, Axes& axes)>;

/// A neck of its own.
void move_axes(const std::optional<std::array<double, 2>>& target_rad, const std::array<Axis, 2>& bounds,
               int64_t now_ns, Axes& axes);

/// The camera head as its host sees it on the bus: the messages of ace_head.dbc in their cycles, the states, limits and
/// watchdogs of D-4.3, mechanics and eyelids that take their time. Booted it is not homed.
class HeadDouble final : public can::NodeDouble {
 public:
  static constexpr int64_t kSetpointStale_ns = 100'000'000;

  HeadDouble(std::string interface, const Clock& clock, Neck neck = move_axes, uint64_t seed = 1);

  void press_emergency_stop(bool pressed) { emergency_stop_ = pressed; }
  /// A following error of the pan axis: a fault until it is reset.
  void block_pan() { fail(kFollowingError); }
  /// What it says of itself.
  void set_health(double temperature_degC, double supply_V) {
    temperature_degC_ = temperature_degC, supply_V_ = supply_V;
  }
  void jam_lids(bool jammed) { lids_jammed_ = jammed; }

  State state() const { return state_; }
  bool homed() const { return homed_; }
  double pan_rad() const { return axes_.position_rad[0]; }
  double tilt_rad() const { return axes_.position_rad[1]; }
  double left_lid_closed_percent() const { return lids_.left; }
  uint8_t blinks() const { return lids_.blinks; }
  uint16_t emergency() const { return emergency_; }

 private:
  struct Lids {
    double left = 100, right = 100;  ///< closed, %
    double from_left = 100, from_right = 100;
    EyelidAction action = EyelidAction::relax;
    std::array<double, EyelidSetpoint::count> told{};
    int64_t since_ns = 0;
    uint8_t token = 0xFF, blinks = 0;
    bool moving = false;
  };

  void forget() override;
  void take(const can::Incoming& incoming) override;
  void started() override { setpoint_ns_ = now_ns(); }
  void step() override;
  void take_setpoint(std::span<const double> values);
  void take_eyelids(std::span<const double> values);
  void watch();
  void move();
  void move_lids();
  void send_due();
  void send_status();
  void fail(uint16_t code);
  void say_emergency(uint16_t code);
  bool may_move() const { return !emergency_stop_ && !fault_ && emergency_ == 0; }

  Neck neck_;
  int64_t setpoint_ns_ = 0;
  State state_ = State::not_ready;
  Mode mode_ = Mode::disable;
  bool homed_ = false, fault_ = false, emergency_stop_ = false, stale_ = false;
  uint16_t emergency_ = 0;
  std::array<double, 2> target_rad_{};
  Axes axes_;
  double asked_speed_rad_s_ = 0, asked_acceleration_rad_s2_ = 0;
  Lids lids_;
  int page_ = 0;
  double temperature_degC_ = 41, supply_V_ = 24;
  bool lids_jammed_ = false;
};

}  // namespace takt::head
