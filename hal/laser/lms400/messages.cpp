// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms400/messages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>

namespace takt::lms400 {
namespace {

constexpr size_t kHead = 20, kTrailer = 18, kNumberInTrailer = 14;
constexpr int32_t kLeast_tdeg = 550'000, kMost_tdeg = 1'250'000;

uint16_t u16(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

void put_u16(std::span<uint8_t> bytes, size_t at, uint32_t value) {
  bytes[at] = static_cast<uint8_t>(value);
  bytes[at + 1] = static_cast<uint8_t>(value >> 8);
}

/// Takes the first word off the text, and the space behind it.
std::string_view take_word(std::string_view& text) {
  const size_t end = std::min(text.find(' '), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return word;
}

std::optional<Kind> kind_of(std::string_view word) {
  if (word == "sMA") return Kind::accepted;
  if (word == "sAN") return Kind::result;
  if (word == "sWA") return Kind::written;
  if (word == "sRA") return Kind::read;
  if (word == "sFA") return Kind::fault;
  return std::nullopt;
}

}  // namespace

std::string_view Answer::word(size_t index) const {
  std::string_view left = rest, word = take_word(left);
  for (; index > 0; --index) word = take_word(left);
  return word;
}

std::optional<Answer> read_answer(std::span<const uint8_t> payload) {
  std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
  const auto kind = kind_of(take_word(text));
  if (!kind) return std::nullopt;
  Answer answer{*kind, {}, {}};
  if (*kind != Kind::fault) answer.name = take_word(text);
  answer.rest = text;
  return answer;
}

std::optional<uint32_t> read_hex(std::string_view word) {
  uint32_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value, 16);
  if (word.empty() || error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::optional<float> read_float_bits(std::string_view word) {
  const auto bits = read_hex(word);
  return bits ? std::optional(std::bit_cast<float>(*bits)) : std::nullopt;
}

std::string configure_scan(const ScanConfiguration& c) {
  std::array<char, 96> text;
  const int size = std::snprintf(text.data(), text.size(), "sMN mSCsetscanconfig %+.2f %+.2f %+.2f %+.2f", c.rate_hz,
                                 c.step_deg, c.first_deg, c.fov_deg);
  return {text.data(), std::min(static_cast<size_t>(size), text.size() - 1)};
}

std::string_view name_of(std::string_view text) {
  take_word(text);
  return take_word(text);
}

size_t bytes_per_beam(Format format) {
  return format == Format::distance_and_remission ? 3 : format == Format::distance ? 2 : 1;
}

uint16_t Measurement::distance(size_t beam) const {
  return format == Format::remission ? uint16_t{0} : u16(beams, beam * bytes_per_beam(format));
}

uint8_t Measurement::remission(size_t beam) const {
  return format == Format::distance ? uint8_t{0} : beams[(beam + 1) * bytes_per_beam(format) - 1];
}

std::optional<Measurement> read_measurement(std::span<const uint8_t> payload) {
  if (payload.size() < kHead + kTrailer || payload[1] != 0 || payload[0] < 0x20 || payload[0] > 0x22)
    return std::nullopt;
  Measurement m;
  m.format = static_cast<Format>(payload[0]);
  m.distance_scale = u16(payload, 2);
  m.first_tdeg = static_cast<int32_t>(uint32_t{u16(payload, 6)} << 16 | u16(payload, 4));
  m.step_tdeg = u16(payload, 8);
  const size_t count = u16(payload, 10);
  m.rate_hz = u16(payload, 12);
  m.remission_scale = u16(payload, 14);
  m.remission_begin = u16(payload, 16);
  m.remission_end = u16(payload, 18);
  if (kHead + count * bytes_per_beam(m.format) + kTrailer != payload.size()) return std::nullopt;
  if (count == 0 || m.step_tdeg == 0 || m.first_tdeg < kLeast_tdeg ||
      int64_t{m.first_tdeg} + static_cast<int64_t>(count - 1) * m.step_tdeg > kMost_tdeg)
    return std::nullopt;
  m.beams = payload.subspan(kHead, count * bytes_per_beam(m.format));
  m.number = u16(payload, kHead + m.beams.size() + kNumberInTrailer);
  return m;
}

size_t write_measurement(const Measurement& m, std::span<uint8_t> payload) {
  const size_t size = kHead + m.beams.size() + kTrailer;
  if (payload.size() < size) return 0;
  std::fill_n(payload.begin(), size, uint8_t{0});
  put_u16(payload, 0, static_cast<uint16_t>(m.format));
  put_u16(payload, 2, m.distance_scale);
  put_u16(payload, 4, static_cast<uint32_t>(m.first_tdeg));
  put_u16(payload, 6, static_cast<uint32_t>(m.first_tdeg) >> 16);
  put_u16(payload, 8, m.step_tdeg);
  put_u16(payload, 10, static_cast<uint32_t>(m.count()));
  put_u16(payload, 12, m.rate_hz);
  put_u16(payload, 14, m.remission_scale);
  put_u16(payload, 16, m.remission_begin);
  put_u16(payload, 18, m.remission_end);
  std::copy(m.beams.begin(), m.beams.end(), payload.begin() + kHead);
  put_u16(payload, kHead + m.beams.size() + kNumberInTrailer, m.number);
  return size;
}

}  // namespace takt::lms400
