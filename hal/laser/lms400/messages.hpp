// SPDX-License-Identifier: Apache-2.0
// What stands in the frames of an LMS 400: text of commands and answers, and measurements (D-2.3 and D-2.4).
// Pure functions over bytes; spans and texts point into the payload.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace takt::lms400 {

enum class Kind : uint8_t {
  accepted,  ///< sMA: a method was called; its result follows, perhaps after measurements
  result,    ///< sAN
  written,   ///< sWA
  read,      ///< sRA
  fault,     ///< sFA
};

struct Answer {
  Kind kind = Kind::fault;
  std::string_view name;  ///< of method or variable; empty for a fault
  std::string_view rest;  ///< what follows, words apart by one space

  /// Word number `index` of the rest; empty if there are fewer.
  std::string_view word(size_t index) const;
};
std::optional<Answer> read_answer(std::span<const uint8_t> payload);
/// A hexadecimal number of any width up to 32 bits.
std::optional<uint32_t> read_hex(std::string_view word);
/// The same as the bits of a float.
std::optional<float> read_float_bits(std::string_view word);

/// What the scanner is to do; answered with what it really does.
struct ScanConfiguration {
  double rate_hz = 360, step_deg = 0.25;
  double first_deg = 55, fov_deg = 70;  ///< 90 degrees: straight ahead
};

// Texts of commands.
inline constexpr std::string_view kStop = "sMN mLRstopdata";
inline constexpr std::string_view kLogin = "sMN SetAccessMode 3 F4724744";  ///< as authorised client
inline constexpr std::string_view kRun = "sMN Run";
inline constexpr std::string_view kSendDistances = "sMN mLRreqdata 21";
std::string configure_scan(const ScanConfiguration& configuration);

/// Of a command or an answer, its three letters and its name: "sMN Run" of "sMN Run".
std::string_view name_of(std::string_view text);

/// What a measurement holds of each beam.
enum class Format : uint16_t { distance_and_remission = 0x20, distance = 0x21, remission = 0x22 };
size_t bytes_per_beam(Format format);

struct Measurement {
  Format format = Format::distance;
  uint16_t distance_scale = 1;  ///< mm of a count
  int32_t first_tdeg = 0;       ///< angle of beam 0, ten thousandths of a degree
  uint16_t step_tdeg = 0;
  uint16_t rate_hz = 0;
  uint16_t remission_scale = 1, remission_begin = 0, remission_end = 0;
  std::span<const uint8_t> beams;  ///< bytes_per_beam() each
  uint16_t number = 0;             ///< counted by the scanner

  size_t count() const { return beams.size() / bytes_per_beam(format); }
  /// In counts; 0: none.
  uint16_t distance(size_t beam) const;
  uint8_t remission(size_t beam) const;
};
/// Nothing if it is no measurement, or one whose fields contradict each other.
std::optional<Measurement> read_measurement(std::span<const uint8_t> payload);
/// Its payload; what the trailer holds besides the number is not known, and 0. Returns the size, 0 where there is no
/// room.
size_t write_measurement(const Measurement& measurement, std::span<uint8_t> payload);

}  // namespace takt::lms400
