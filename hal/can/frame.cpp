// SPDX-License-Identifier: Apache-2.0
#include "hal/can/frame.hpp"

#include <linux/can.h>
#include <linux/can/error.h>

#include <algorithm>
#include <cstring>

namespace takt::can {

static_assert(sizeof(can_frame) == sizeof(WireFrame));
static_assert(kErrorFlag == CAN_ERR_FLAG);

WireFrame to_wire(const Frame& frame) {
  can_frame wire{};
  wire.can_id = frame.id;
  wire.len = frame.length;
  std::copy_n(frame.data.begin(), frame.length, wire.data);
  WireFrame bytes;
  std::memcpy(bytes.data(), &wire, sizeof(wire));
  return bytes;
}

std::optional<Frame> from_wire(std::span<const uint8_t> bytes) {
  can_frame wire;
  if (bytes.size() != sizeof(wire)) return std::nullopt;
  std::memcpy(&wire, bytes.data(), sizeof(wire));
  if (wire.len > CAN_MAX_DLEN || (wire.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0) return std::nullopt;
  Frame frame{wire.can_id, wire.len, {}};
  std::copy_n(wire.data, wire.len, frame.data.begin());
  return frame;
}

void BusWatch::observe(const Frame& error) {
  ++error_frames;
  const auto is = [&](uint32_t kind) { return (error.id & kind) != 0; };
  if (is(CAN_ERR_CRTL)) {
    const uint8_t said = error.data[1];
    if (said & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) ++overflows;
    if (said & CAN_ERR_CRTL_ACTIVE) state = BusState::active;
    if (said & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) state = BusState::warning;
    if (said & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) state = BusState::passive;
    transmit_errors = error.data[6];
    receive_errors = error.data[7];
  }
  if (is(CAN_ERR_ACK)) ++unacknowledged;
  if (is(CAN_ERR_BUSOFF)) state = BusState::off;
  if (is(CAN_ERR_RESTARTED)) {
    state = BusState::active;
    ++restarts;
  }
}

}  // namespace takt::can
