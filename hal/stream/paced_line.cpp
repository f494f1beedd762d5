// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/paced_line.hpp"

#include <algorithm>
#include <array>

namespace takt {

std::vector<uint8_t> received_at_other_rate(std::span<const uint8_t> bytes, uint32_t from, uint32_t to) {
  // In ticks of 1 / (from * to) seconds a bit of the sender lasts `to`, one of the receiver `from`.
  const uint64_t sent_bits = 10 * uint64_t{bytes.size()};
  const auto level = [&](uint64_t tick) {
    const uint64_t bit = tick / to, place = bit % 10;
    if (bit >= sent_bits || place == 9) return true;  // the line rests, or a stop bit
    return place != 0 && (bytes[bit / 10] >> (place - 1) & 1) != 0;
  };
  std::vector<uint8_t> received;
  for (uint64_t tick = 0; tick / to < sent_bits;) {
    if (level(tick)) {
      tick = (tick / to + 1) * to;  // levels change between the sender's bits only
      continue;
    }
    const auto bit = [&](uint64_t index) { return level(tick + from / 2 + index * from); };
    uint8_t byte = 0;
    for (uint64_t i = 0; i < 8; ++i) byte = static_cast<uint8_t>(byte | (bit(i + 1) ? 1u << i : 0u));
    received.push_back(bit(9) ? byte : uint8_t{0});
    tick += from / 2 + 9 * from;
    while (!level(tick)) tick = (tick / to + 1) * to;
  }
  return received;
}

void PacedLine::send(int64_t at_ns, std::span<const uint8_t> bytes) {
  const int64_t begin = std::max(at_ns, free_ns_);
  pieces_.push_back({begin, {bytes.begin(), bytes.end()}});
  free_ns_ = begin + static_cast<int64_t>(bytes.size()) * byte_time_ns(baud_);
}

void PacedLine::interrupt(int64_t now_ns) {
  run_to(now_ns);
  pieces_.clear();
  free_ns_ = now_ns;
}

void PacedLine::run_to(int64_t now_ns) {
  const int64_t byte_ns = byte_time_ns(baud_);
  for (; !pieces_.empty(); pieces_.pop_front()) {
    Piece& piece = pieces_.front();
    if (now_ns < piece.at_ns) return;
    const size_t left = byte_ns == 0
                            ? piece.bytes.size()
                            : std::min(piece.bytes.size(), static_cast<size_t>((now_ns - piece.at_ns) / byte_ns));
    if (left > piece.gone) line_.write(across(std::span(piece.bytes).subspan(piece.gone, left - piece.gone), true));
    piece.gone = left;
    if (left < piece.bytes.size()) return;
  }
}

std::vector<uint8_t> PacedLine::receive() {
  std::array<uint8_t, 256> bytes;
  return across(std::span(bytes).first(line_.read(bytes).value_or(0)), false);
}

std::vector<uint8_t> PacedLine::across(std::span<const uint8_t> bytes, bool to_host) const {
  const uint32_t host = line_.baud();
  if (baud_ == 0 || host == 0 || host == baud_) return {bytes.begin(), bytes.end()};
  return to_host ? received_at_other_rate(bytes, baud_, host) : received_at_other_rate(bytes, host, baud_);
}

}  // namespace takt
