// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms400/frame.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

namespace takt::lms400 {
namespace {

constexpr size_t kStxs = 4;

uint32_t length_of(std::span<const uint8_t> header) {
  return uint32_t{header[4]} << 24 | uint32_t{header[5]} << 16 | uint32_t{header[6]} << 8 | header[7];
}

}  // namespace

uint8_t checksum(std::span<const uint8_t> payload) {
  return std::accumulate(payload.begin(), payload.end(), uint8_t{0}, std::bit_xor<uint8_t>());
}

Frame::Frame(std::span<const uint8_t> payload) {
  payload = payload.first(std::min(payload.size(), kLargestPayload));
  std::fill_n(bytes_.begin(), kStxs, kStx);
  for (size_t i = 0; i < 4; ++i) bytes_[kStxs + i] = static_cast<uint8_t>(payload.size() >> (24 - 8 * i));
  std::copy(payload.begin(), payload.end(), bytes_.begin() + kHeader);
  bytes_[kHeader + payload.size()] = checksum(payload);
  size_ = kFraming + payload.size();
}

std::optional<Event> Parser::next() {
  drop_claimed();
  for (;;) {
    const auto bytes = this->bytes();
    const auto run = bytes.first(std::min(bytes.size(), kStxs));
    const auto other = std::find_if(run.begin(), run.end(), [](uint8_t byte) { return byte != kStx; });
    if (other != run.end()) {
      skip(static_cast<size_t>(other - run.begin()) + 1);
      continue;
    }
    if (bytes.size() <= kStxs) return std::nullopt;
    if (bytes[kStxs] == kStx) {  // no length begins so
      skip(1);
      continue;
    }
    if (bytes.size() < kHeader) return std::nullopt;
    const auto refused = [this](EventKind kind) {
      const Event event{kind, position(), {}};
      skip(1);
      return event;
    };
    const uint32_t length = length_of(bytes);
    if (length == 0 || length > kLargestPayload) return refused(EventKind::length_error);
    if (bytes.size() < length + kFraming) return std::nullopt;
    const auto payload = bytes.subspan(kHeader, length);
    if (checksum(payload) != bytes[kHeader + length]) return refused(EventKind::checksum_error);
    claim(length + kFraming);
    return Event{EventKind::frame, position(), payload};
  }
}

}  // namespace takt::lms400
