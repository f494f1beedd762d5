// SPDX-License-Identifier: Apache-2.0
// Scans of an LMS 2xx (reply B0h; SICK 8007954 chapter 7, D-1.7). Pure functions over bytes.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "hal/laser/lms200/telegram.hpp"

namespace takt::lms200 {

inline constexpr uint8_t kIndices = 0x02;  ///< bit of Configuration::availability()

/// A scan as it stands in a telegram.
struct Scan {
  struct Indices {
    uint8_t scan = 0, telegram = 0;
    bool operator==(const Indices&) const = default;
  };
  bool millimetres = true;         ///< else centimetres
  bool partial = false;            ///< every whole degree, plus a quarter, half or three quarters
  uint8_t quarters = 0;            ///< how many quarters, 0..3
  std::span<const uint8_t> words;  ///< two bytes a beam, low one first; beam 0 at the right
  std::optional<Indices> indices;  ///< where the configuration asks for them
  uint8_t status = 0;

  size_t beams() const { return words.size() / 2; }
  uint16_t word(size_t beam) const { return read_u16(words, 2 * beam); }
};

/// Nothing if the payload is no scan, or has another length than its own count of beams.
std::optional<Scan> read_scan(std::span<const uint8_t> payload);
/// At most 401 beams.
Telegram scan_telegram(const Scan& scan);

/// How many of a word's 16 bits are the distance; those above are flags. Nothing for modes that measure something else.
std::optional<int> distance_bits(uint8_t measuring_mode);

enum class Echo : uint8_t { valid, none, dazzled, overflow, noisy, read_error, out_of_range, unknown };
/// Nothing is known of what is there, unlike where nothing came back, or what lies beyond the range.
constexpr bool blinded(Echo echo) { return echo != Echo::valid && echo != Echo::none && echo != Echo::out_of_range; }

struct Beam {
  uint16_t distance = 0;  ///< in the scan's unit; 0 unless valid
  uint8_t flags = 0;      ///< the bits above the distance, the lowest first
  Echo echo = Echo::valid;
};
/// Flags first, special values then: the highest nine of what the distance bits can hold are no distances.
Beam read_beam(uint16_t word, int distance_bits);
/// What a beam that hit nothing, or nothing of use, says.
constexpr uint16_t no_echo(int distance_bits) { return static_cast<uint16_t>((1u << distance_bits) - 1); }
/// The largest distance.
constexpr uint16_t largest_distance(int distance_bits) { return static_cast<uint16_t>((1u << distance_bits) - 10); }

/// Metres; 0: nothing within the range; NaN: the beam is blinded, as in measuring mode 0 a flag says of it, too.
float range_m(uint16_t word, uint8_t measuring_mode, bool millimetres);

}  // namespace takt::lms200
