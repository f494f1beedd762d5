// SPDX-License-Identifier: Apache-2.0
// The camera head's messages (ace_head.dbc, D-4). The identifiers and layouts are this project's own.
#pragma once
#include <cstdint>
#include <numbers>

#include "hal/can/codec.hpp"
#include "hal/can/node_guard.hpp"

namespace takt::head {

/// Places in messages().
enum MessagePlace : size_t {
  kNodeCommand,
  kSync,
  kEmergency,
  kPosStatus,
  kVelStatus,
  kEyelidStatus,
  kHealth,
  kLimits,
  kSetpoint,
  kVelSetpoint,
  kEyelidSetpoint,
  kHostHeartbeat,
  kHeartbeat,
};
std::span<const can::Message> messages();
constexpr can::NodePlaces kPlaces{16, kNodeCommand, kHostHeartbeat, kHeartbeat};
constexpr int64_t kStatusCycle_ns = 10'000'000;  ///< GenMsgCycleTime of HEAD_PosStatus (D-4.1)

constexpr double kDegree = std::numbers::pi / 180;

/// Places of the signals in a message's values. Angles in degrees, as on the bus.
struct Emergency {
  enum : size_t { code, error_register, axis, data, count };
};
struct PosStatus {
  enum : size_t {
    state,
    pan,
    tilt,
    pan_reached,
    tilt_reached,
    pan_homed,
    tilt_homed,
    pan_at_low,
    pan_at_high,
    tilt_at_low,
    tilt_at_high,
    emergency_stop,
    servo_power,
    brake,
    setpoint_stale,
    over_temperature,
    under_voltage,
    following_error,
    fault,
    count
  };
};
struct VelStatus {
  enum : size_t { pan, tilt, sample_ms, count };
};
struct EyelidStatus {
  enum : size_t { state, left, right, left_current, right_current, volts, blinks, count };
};
struct Health {
  enum : size_t { pan_degC, tilt_degC, volts, amperes, uptime_s, count };
};
/// Page 0: pan, 1: tilt (least, most, soft margin); 2: speeds and acceleration.
struct Limits {
  enum : size_t {
    page,
    pan_low,
    pan_high,
    pan_margin,
    tilt_low,
    tilt_high,
    tilt_margin,
    pan_speed,
    tilt_speed,
    acceleration,
    count
  };
};
struct Setpoint {
  enum : size_t { mode, pan, tilt, speed, acceleration, count };
};
struct EyelidSetpoint {
  enum : size_t { action, left, right, move_ms, hold_ms, repeat, token, count };
};

/// PS_State, after CiA 402.
enum class State : uint8_t {
  not_ready,
  switch_on_disabled,
  ready,
  switched_on,
  operation_enabled,
  quick_stop,
  fault_reaction,
  fault
};
/// SP_Mode.
enum class Mode : uint8_t {
  disable = 0,
  position = 1,
  velocity = 2,
  hold = 3,
  home = 4,
  fault_reset = 14,
  quick_stop = 15
};
/// EL_Action and ES_State.
enum class EyelidAction : uint8_t { hold, position, blink, wink_left, wink_right, relax };
enum class EyelidState : uint8_t { off, idle, moving, blinking, stalled, fault };

/// EM_Code (CiA 301).
constexpr uint16_t kSupplyLow = 0x3120, kHeartbeatLost = 0x8130, kFollowingError = 0x8611;

}  // namespace takt::head
