// SPDX-License-Identifier: Apache-2.0
// The mobile base's messages (ace_base.dbc): this project's own, because the platform's protocol is not public.
#pragma once
#include <cstdint>

#include "hal/can/codec.hpp"
#include "hal/can/node_guard.hpp"

namespace takt::base {

constexpr uint32_t kWheelCounts = 1u << 24;  ///< counts are modulo this

/// Places in messages().
enum MessagePlace : size_t { kNodeCommand, kWheels, kMotion, kCommand, kHostHeartbeat, kHeartbeat };
std::span<const can::Message> messages();
constexpr can::NodePlaces kPlaces{32, kNodeCommand, kHostHeartbeat, kHeartbeat};
constexpr int64_t kWheelsCycle_ns = 10'000'000;  ///< GenMsgCycleTime of BASE_Wheels

/// Places of the signals in a message's values.
struct Wheels {
  enum : size_t { state, left, right, count };
};
struct Motion {
  enum : size_t { emergency_stop, bumper, command_stale, fault, speed_m_s, turn_rad_s, sample_ms, count };
};
struct Command {
  enum : size_t { mode, speed_m_s, turn_rad_s, acceleration_m_s2, count };
};

/// WH_State and CO_Mode.
enum class State : uint8_t { not_ready, disabled, enabled, fault };
enum class Mode : uint8_t { disable, drive, fault_reset };

}  // namespace takt::base
