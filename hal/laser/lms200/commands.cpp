// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/commands.hpp"

#include <algorithm>
#include <initializer_list>

namespace takt::lms200 {
namespace {

struct BaudCode {
  uint32_t baud;
  uint8_t mode;     ///< of command 20h
  uint16_t status;  ///< in the status reply
};
constexpr BaudCode kBaudCodes[] = {
    {500000, 0x48, 0x8001}, {38400, 0x40, 0x8019}, {19200, 0x41, 0x8033}, {9600, 0x42, 0x8067}};

Telegram telegram(Command code, std::span<const uint8_t> data = {}) {
  std::array<uint8_t, 64> payload{static_cast<uint8_t>(code)};
  std::copy(data.begin(), data.end(), payload.begin() + 1);
  return {0, std::span(payload).first(1 + data.size())};
}

Telegram telegram(Command code, std::initializer_list<uint8_t> data) {
  return telegram(code, std::span(data.begin(), data.size()));
}

bool is(std::span<const uint8_t> payload, Reply code, size_t least) {
  return payload.size() >= least && payload[0] == static_cast<uint8_t>(code);
}

// Offsets in the payload of the status reply.
enum StatusField : size_t {
  kVersion = 1,
  kMode = 8,
  kDefective = 9,
  kPollution = 19,
  kTurn = 67,
  kMeasuringMode = 102,
  kAngle = 107,
  kStep = 109,
  kBaud = 116,
  kAddress = 120,
  kUnitField = 122,
  kLaser = 123,
  kStatusPayload = 154
};

}  // namespace

Telegram command(Command code) { return telegram(code); }
Telegram switch_mode(Mode mode) { return telegram(Command::mode, {static_cast<uint8_t>(mode)}); }
Telegram enter_installation() {
  std::array<uint8_t, 1 + kInstallationPassword.size()> data{static_cast<uint8_t>(Mode::installation)};
  std::copy(kInstallationPassword.begin(), kInstallationPassword.end(), data.begin() + 1);
  return telegram(Command::mode, data);
}
Telegram switch_baud(uint32_t baud) {
  const auto* code = std::find_if(std::begin(kBaudCodes), std::end(kBaudCodes) - 1,
                                  [&](const BaudCode& known) { return known.baud == baud; });
  return telegram(Command::mode, {code->mode});
}
Telegram request_scan() { return telegram(Command::scan, {1}); }
Telegram switch_variant(const Variant& v) {
  return telegram(Command::variant, {static_cast<uint8_t>(v.angle_deg), static_cast<uint8_t>(v.angle_deg >> 8),
                                     static_cast<uint8_t>(v.step_cdeg), static_cast<uint8_t>(v.step_cdeg >> 8)});
}
Telegram write_configuration(const Configuration& configuration) {
  return telegram(Command::write_configuration, configuration.bytes);
}
Telegram keep_baud(bool keep) { return telegram(Command::keep_baud, {keep ? uint8_t{1} : uint8_t{0}}); }

Telegram reply(Reply code, std::span<const uint8_t> data, uint8_t status) {
  std::array<uint8_t, kLargestPayload> payload{static_cast<uint8_t>(code)};
  data = data.first(std::min(data.size(), kLargestPayload - 2));
  std::copy(data.begin(), data.end(), payload.begin() + 1);
  payload[1 + data.size()] = status;
  return {kFromLms, std::span(payload).first(2 + data.size())};
}

std::array<uint8_t, 152> status_data(const Status& s) {
  std::array<uint8_t, 152> data{};
  const auto put = [&](size_t field, uint32_t value) { data[field - 1] = static_cast<uint8_t>(value); };
  const auto put_u16 = [&](size_t field, uint32_t value) {
    put(field, value);
    put(field + 1, value >> 8);
  };
  std::copy(s.version.begin(), s.version.end(), data.begin() + kVersion - 1);
  put(kMode, static_cast<uint8_t>(s.mode));
  put(kDefective, s.defective ? 1 : 0);
  for (size_t i = 0; i < s.pollution.size(); ++i) put_u16(kPollution + 2 * i, s.pollution[i]);
  put_u16(kTurn, s.turn_us);
  put(kMeasuringMode, s.measuring_mode);
  put_u16(kAngle, s.variant.angle_deg);
  put_u16(kStep, s.variant.step_cdeg);
  for (const BaudCode& code : kBaudCodes)
    if (code.baud == s.baud) put_u16(kBaud, code.status);
  put(kAddress, s.address);
  put(kUnitField, s.millimetres ? 1 : 0);
  put(kLaser, s.laser_on ? 1 : 0);
  return data;
}

std::optional<Reply> reply_code(std::span<const uint8_t> payload) {
  if (payload.size() < 2) return std::nullopt;
  return static_cast<Reply>(payload[0]);
}

std::optional<Status> read_status(std::span<const uint8_t> payload) {
  if (!is(payload, Reply::status, kStatusPayload)) return std::nullopt;
  Status s;
  for (size_t i = 0; i < s.version.size(); ++i) s.version[i] = static_cast<char>(payload[kVersion + i]);
  s.mode = static_cast<Mode>(payload[kMode]);
  s.defective = payload[kDefective] != 0;
  for (size_t i = 0; i < s.pollution.size(); ++i) s.pollution[i] = read_u16(payload, kPollution + 2 * i);
  s.turn_us = read_u16(payload, kTurn);
  s.measuring_mode = payload[kMeasuringMode];
  s.variant = {read_u16(payload, kAngle), read_u16(payload, kStep)};
  for (const BaudCode& code : kBaudCodes)
    if (code.status == read_u16(payload, kBaud)) s.baud = code.baud;
  s.address = payload[kAddress];
  s.millimetres = payload[kUnitField] == 1;
  s.laser_on = payload[kLaser] == 1;
  return s;
}

std::optional<uint8_t> read_error(std::span<const uint8_t> payload) {
  constexpr uint8_t kOldEntry = 0x80;
  if (!is(payload, Reply::errors, 2)) return std::nullopt;
  // Pairs of type and number follow the count; the status byte is last.
  for (size_t at = 2; at + 2 < payload.size() && at < 2 + 2 * static_cast<size_t>(payload[1]); at += 2)
    if ((payload[at] & kOldEntry) == 0) return payload[at + 1];
  return 0;
}

const char* error_text(uint8_t number) {
  switch (number) {
    case 5: return "the scanner says that it is dazzled";
    case 17:
    case 18:
    case 19:
    case 20:
    case 21:
    case 22: return "the scanner says that its front pane is too dirty: clean it";
    case 29: return "the scanner says that its motor turns at a wrong speed";
    case 45:
    case 46: return "the scanner says that it misses measurements";
    case 56: return "the scanner says that its watchdog has struck";
    case 57: return "the scanner says that it finds no index of its mirror";
    default: return "the scanner says that it is in error";
  }
}

std::optional<Configuration> read_configuration(std::span<const uint8_t> payload) {
  // The reply to a change has a byte before it that says whether it was made.
  const size_t before = is(payload, Reply::configuration_written, 1) ? 2 : 1;
  Configuration configuration;
  const size_t whole = before + configuration.bytes.size() + 1;
  if (payload.size() != whole || (before == 1 && !is(payload, Reply::configuration, whole))) return std::nullopt;
  std::copy_n(payload.begin() + static_cast<ptrdiff_t>(before), configuration.bytes.size(),
              configuration.bytes.begin());
  return configuration;
}

std::string_view read_text(std::span<const uint8_t> payload) {
  if (!is(payload, Reply::power_on, 2) && !is(payload, Reply::type, 2)) return {};
  return {reinterpret_cast<const char*>(payload.data()) + 1, payload.size() - 2};
}

bool read_success(std::span<const uint8_t> payload) {
  if (is(payload, Reply::mode, 3)) return payload[1] == 0;
  return (is(payload, Reply::variant, 7) || is(payload, Reply::configuration_written, 3)) && payload[1] == 1;
}

std::optional<Variant> read_variant(std::span<const uint8_t> payload) {
  if (!is(payload, Reply::variant, 7)) return std::nullopt;
  return Variant{read_u16(payload, 2), read_u16(payload, 4)};
}

std::optional<uint32_t> baud_of_mode(uint8_t mode) {
  for (const BaudCode& code : kBaudCodes)
    if (code.mode == mode) return code.baud;
  return std::nullopt;
}

}  // namespace takt::lms200
