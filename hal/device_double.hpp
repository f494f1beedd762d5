// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "hal/device.hpp"

namespace takt {

enum class Misbehaviour : uint8_t {
  none,
  silent,      ///< hears, but nothing of what it says arrives
  garbage,     ///< every byte arrives as another one
  crc_errors,  ///< every telegram arrives with a wrong checksum
  wrong_baud,  ///< the device falls to another rate of its own than was agreed
  unplugged,   ///< the line is gone, the device goes on
  frozen,      ///< the same values again and again, in good telegrams
};

inline constexpr std::array<std::pair<std::string_view, Misbehaviour>, 7> kMisbehaviours{
    {{"none", Misbehaviour::none},
     {"silent", Misbehaviour::silent},
     {"garbage", Misbehaviour::garbage},
     {"crc_errors", Misbehaviour::crc_errors},
     {"wrong_baud", Misbehaviour::wrong_baud},
     {"unplugged", Misbehaviour::unplugged},
     {"frozen", Misbehaviour::frozen}}};

inline std::optional<Misbehaviour> misbehaviour_of(std::string_view word) {
  for (const auto& [name, misbehaviour] : kMisbehaviours)
    if (name == word) return misbehaviour;
  return std::nullopt;
}

/// Stands in for a device at the far end of its line: the device's bytes, at the device's times. It has no thread and
/// no clock: what happens until an instant is done by run_to(). One thread at a time.
class DeviceDouble {
 public:
  DeviceDouble() = default;
  DeviceDouble(const DeviceDouble&) = delete;
  DeviceDouble& operator=(const DeviceDouble&) = delete;
  virtual ~DeviceDouble() = default;

  /// Before the first run_to(): makes the line.
  virtual DeviceResult plug_in() = 0;
  /// Does what is due until that instant; instants never go back. Bytes of the host count as arrived now.
  virtual void run_to(int64_t now_ns) = 0;
  /// From now on, until another one is given.
  virtual void misbehave(Misbehaviour misbehaviour) = 0;
};

}  // namespace takt
