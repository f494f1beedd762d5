// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/scan.hpp"

#include <algorithm>
#include <limits>

namespace takt::lms200 {
namespace {

constexpr uint8_t kScanReply = 0xB0;
constexpr uint16_t kCount = 0x3FF, kPartial = 0x2000, kMillimetres = 0x4000, kUnit = 0xC000;
constexpr int kQuartersShift = 11;
constexpr size_t kBefore = 3, kMostBeams = 401;

}  // namespace

std::optional<Scan> read_scan(std::span<const uint8_t> payload) {
  if (payload.size() < kBefore + 1 || payload[0] != kScanReply) return std::nullopt;
  const uint16_t head = read_u16(payload, 1);
  const size_t words = 2 * static_cast<size_t>(head & kCount), end = kBefore + words;
  const bool indices = payload.size() == end + 3;
  if ((head & kUnit) > kMillimetres || (!indices && payload.size() != end + 1)) return std::nullopt;
  Scan scan;
  scan.millimetres = (head & kUnit) == kMillimetres;
  scan.partial = (head & kPartial) != 0;
  scan.quarters = static_cast<uint8_t>(head >> kQuartersShift & 3);
  scan.words = payload.subspan(kBefore, words);
  if (indices) scan.indices = {payload[end], payload[end + 1]};
  scan.status = payload.back();
  return scan;
}

Telegram scan_telegram(const Scan& scan) {
  std::array<uint8_t, kLargestPayload> payload{kScanReply};
  const size_t words = 2 * std::min(scan.beams(), kMostBeams);
  const auto head = static_cast<uint16_t>(words / 2 | (scan.millimetres ? kMillimetres : 0u) |
                                          (scan.partial ? kPartial : 0u) | uint32_t{scan.quarters} << kQuartersShift);
  payload[1] = static_cast<uint8_t>(head);
  payload[2] = static_cast<uint8_t>(head >> 8);
  std::copy_n(scan.words.begin(), words, payload.begin() + kBefore);
  size_t end = kBefore + words;
  if (scan.indices) {
    payload[end++] = scan.indices->scan;
    payload[end++] = scan.indices->telegram;
  }
  payload[end++] = scan.status;
  return {kFromLms, std::span(payload).first(end)};
}

std::optional<int> distance_bits(uint8_t measuring_mode) {
  switch (measuring_mode) {
    case 0x00:  // 8 m: fields A and B, dazzled
    case 0x01:  // 8 m: reflectors
    case 0x02:  // 8 m: fields A, B and C
      return 13;
    case 0x03:  // 16 m: reflectors
    case 0x04:  // 16 m: fields A and B
      return 14;
    case 0x05:  // 32 m: reflectors
    case 0x06:  // 32 m: field A
      return 15;
    default: return std::nullopt;
  }
}

Beam read_beam(uint16_t word, int bits) {
  Beam beam;
  beam.flags = static_cast<uint8_t>(word >> bits);
  const auto value = static_cast<uint16_t>(word & no_echo(bits));
  switch (no_echo(bits) - value) {  // 1FFFh, 1FFEh ... of 13 bits
    case 0: beam.echo = Echo::none; break;
    case 1: beam.echo = Echo::dazzled; break;
    case 2: beam.echo = Echo::overflow; break;
    case 4: beam.echo = Echo::noisy; break;
    case 5: beam.echo = Echo::read_error; break;
    case 8: beam.echo = Echo::out_of_range; break;
    default: beam.echo = value > largest_distance(bits) ? Echo::unknown : Echo::valid;
  }
  if (beam.echo == Echo::valid) beam.distance = value;
  return beam;
}

float range_m(uint16_t word, uint8_t measuring_mode, bool millimetres) {
  constexpr uint8_t kDazzled = 4;  // of mode 0
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  const auto bits = distance_bits(measuring_mode);
  if (!bits) return kUnknown;
  const Beam beam = read_beam(word, *bits);
  if (blinded(beam.echo) || (measuring_mode == 0 && (beam.flags & kDazzled) != 0)) return kUnknown;
  return static_cast<float>(beam.distance) * (millimetres ? 0.001f : 0.01f);
}

}  // namespace takt::lms200
