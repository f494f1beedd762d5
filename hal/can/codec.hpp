// SPDX-License-Identifier: Apache-2.0
// From the rows of a DBC file to frames and back: pure functions over bytes.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "hal/can/frame.hpp"

namespace takt::can {

/// Pages of a multiplexed message.
constexpr int8_t kEveryPage = -1, kPageNumber = -2;

/// One signal in Intel order (`@1`): bit 0 is the lowest of byte 0. physical = raw * factor + offset.
struct Signal {
  std::string_view name;
  uint8_t start, bits;
  bool is_signed;
  double factor, offset, low, high;  ///< low and high: the physical values that it may have
  int8_t page = kEveryPage;          ///< kPageNumber: it says which page the frame is
};

enum class Sender : uint8_t { host, device };

/// One message. If protected, byte 0 holds the CRC and the low half of byte 1 the counter of AUTOSAR E2E profile 1A;
/// neither is a signal here. Reserved bits are sent as 0 and ignored.
struct Message {
  std::string_view name;
  uint32_t id;
  uint8_t length;
  Sender sender;
  bool is_protected;
  std::span<const Signal> signals;

  uint16_t data_id() const { return static_cast<uint16_t>(0xA000u | id); }  ///< D-4.2
};
constexpr size_t kMostSignals = 20;

/// `values`: one per signal, physical. What is beyond a signal's range becomes the nearest that is not, a NaN the
/// nearest to 0. Of a multiplexed message only the signals of the page in `values` are sent.
Frame encode(const Message& message, std::span<const double> values);

/// False, and `values` as they were, for another length or a value out of its range. Signals of other pages keep the
/// values that they have.
bool decode(const Message& message, const Frame& frame, std::span<double> values);

}  // namespace takt::can
