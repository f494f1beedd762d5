// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/assembly.hpp"

#include <algorithm>

namespace takt::semantic_link {

Assembly::Step Assembly::add(const Packet& packet) {
  const Header& h = packet.header;
  if (h.message_bytes > buffer_.size()) return Step::refused;
  if (h.fragments == 1) {
    message_ = packet.payload;
    if (have_ != 0 && h.number > number_) {
      ++given_up_;
      have_ = 0;
    }
    return Step::complete;
  }
  if (have_ != 0 && h.number < number_) return Step::incomplete;
  const size_t unit = unit_of(packet);
  if (have_ == 0 || h.number > number_) {
    if (have_ != 0) ++given_up_;
    number_ = h.number;
    message_bytes_ = h.message_bytes;
    unit_ = unit;
    have_ = 0;
  } else if (h.message_bytes != message_bytes_ || unit != unit_) {
    return Step::refused;
  }
  std::copy(packet.payload.begin(), packet.payload.end(), buffer_.begin() + static_cast<ptrdiff_t>(h.fragment * unit_));
  have_ |= uint64_t{1} << h.fragment;
  if (have_ != UINT64_MAX >> (64 - h.fragments)) return Step::incomplete;
  message_ = std::span(buffer_).first(message_bytes_);
  have_ = 0;
  return Step::complete;
}

}  // namespace takt::semantic_link
