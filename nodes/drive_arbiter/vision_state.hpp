// SPDX-License-Identifier: Apache-2.0
// What vision is for at present, and who drives then (thesis App. A; ).
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace takt::drive_arbiter {

/// Who asks for speeds.
enum class Driver : uint8_t { client, tracking };
constexpr size_t kDrivers = 2;

enum class VisionState : uint8_t {
  search,   ///< for crossings and other objects, while the robot client drives
  pose,     ///< of bodies: the robot stands, so that they are measured from one place
  tracking  ///< of a person, who is followed: tracking alone drives
};
constexpr std::array<std::string_view, 3> kVisionStates{"search", "pose", "tracking"};

/// The state of that name, none: there is none.
constexpr std::optional<VisionState> vision_state(std::string_view word) {
  for (size_t i = 0; i < kVisionStates.size(); ++i)
    if (kVisionStates[i] == word) return static_cast<VisionState>(i);
  return std::nullopt;
}

/// Whose speeds pass, and nobody else's; none: the robot stands.
constexpr std::optional<Driver> driver_of(VisionState state) {
  if (state == VisionState::search) return Driver::client;
  if (state == VisionState::tracking) return Driver::tracking;
  return std::nullopt;
}

}  // namespace takt::drive_arbiter
