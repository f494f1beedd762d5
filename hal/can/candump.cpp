// SPDX-License-Identifier: Apache-2.0
#include "hal/can/candump.hpp"

#include <linux/can.h>

#include <cstdio>
#include <cstring>

namespace takt::can {
namespace {

std::string hex(unsigned value, int digits) {
  char text[9];
  std::snprintf(text, sizeof text, "%0*X", digits, value);
  return text;
}

std::string id_text(canid_t id) {
  if ((id & CAN_ERR_FLAG) != 0) return hex(id & (CAN_ERR_MASK | CAN_ERR_FLAG), 8);
  return (id & CAN_EFF_FLAG) != 0 ? hex(id & CAN_EFF_MASK, 8) : hex(id & CAN_SFF_MASK, 3);
}

std::string data_text(const uint8_t* data, size_t size) {
  std::string text;
  for (size_t i = 0; i < size; ++i) text += hex(data[i], 2);
  return text;
}

}  // namespace

std::optional<DumpedFrame> candump_text(std::span<const uint8_t> packet) {
  if (packet.size() == CANFD_MTU) {
    canfd_frame frame;
    std::memcpy(&frame, packet.data(), sizeof frame);
    if (frame.len > CANFD_MAX_DLEN) return std::nullopt;
    return DumpedFrame{FrameSort::fd,
                       id_text(frame.can_id) + "##" + hex(frame.flags & 0xFU, 1) + data_text(frame.data, frame.len)};
  }
  can_frame frame;
  if (packet.size() != sizeof frame) return std::nullopt;
  std::memcpy(&frame, packet.data(), sizeof frame);
  if (frame.len > CAN_MAX_DLEN) return std::nullopt;
  const bool error = (frame.can_id & CAN_ERR_FLAG) != 0, remote = !error && (frame.can_id & CAN_RTR_FLAG) != 0;
  std::string text = id_text(frame.can_id) + "#";
  if (remote) text += frame.len > 0 ? "R" + std::to_string(frame.len) : "R";
  else text += data_text(frame.data, frame.len);
  // A length code above 8, which means 8 bytes all the same.
  if (frame.len == CAN_MAX_DLEN && frame.len8_dlc > CAN_MAX_DLEN && frame.len8_dlc <= CAN_MAX_RAW_DLC)
    text += "_" + hex(frame.len8_dlc, 1);
  const FrameSort sort = error                                ? FrameSort::error
                         : remote                             ? FrameSort::remote
                         : (frame.can_id & CAN_EFF_FLAG) != 0 ? FrameSort::extended
                                                              : FrameSort::standard;
  return DumpedFrame{sort, std::move(text)};
}

}  // namespace takt::can
