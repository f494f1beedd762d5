// SPDX-License-Identifier: Apache-2.0
// What is said to an LMS 2xx, and what it answers (SICK 8007954 chapter 7, D-1.5 and D-1.6). Pure functions over
// bytes.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/laser/lms200/telegram.hpp"

namespace takt::lms200 {

enum class Command : uint8_t {
  reset = 0x10,
  mode = 0x20,
  scan = 0x30,
  status = 0x31,
  errors = 0x32,
  type = 0x3A,
  variant = 0x3B,
  keep_baud = 0x66,
  read_configuration = 0x74,
  write_configuration = 0x77,
};

/// The first byte of a reply: that of its command + 80h, but for the three that answer none or many.
enum class Reply : uint8_t {
  power_on = 0x90,
  reset = 0x91,
  not_permitted = 0x92,
  mode = 0xA0,
  scan = 0xB0,
  status = 0xB1,
  errors = 0xB2,
  type = 0xBA,
  variant = 0xBB,
  keep_baud = 0xE6,
  configuration = 0xF4,
  configuration_written = 0xF7,
};

enum class Mode : uint8_t {
  installation = 0x00,
  diagnosis = 0x10,
  stream = 0x24,          ///< every scan
  on_request = 0x25,      ///< silent until asked; after power-on
  stream_partial = 0x2A,  ///< every turn's whole degrees, the quarter degrees between them in the turns that follow
};

inline constexpr std::array<uint8_t, 8> kInstallationPassword{'S', 'I', 'C', 'K', '_', 'L', 'M', 'S'};

/// Field of view, 100 or 180 degrees, and step, 100, 50 or 25 hundredths of a degree.
struct Variant {
  uint16_t angle_deg = 180, step_cdeg = 50;
  bool operator==(const Variant&) const = default;
};

/// The 34 bytes of commands 74h and 77h, of which three matter here. They are to be read before they are written, so
/// that the others stay as they are.
struct Configuration {
  std::array<uint8_t, 34> bytes{};
  uint8_t availability() const { return bytes[4]; }  ///< bit 1: scans carry indices
  uint8_t measuring_mode() const { return bytes[5]; }
  bool millimetres() const { return bytes[6] == 1; }
  void set(uint8_t measuring_mode, bool millimetres) {
    bytes[5] = measuring_mode;
    bytes[6] = millimetres ? 1 : 0;
  }
};

/// Fields of the status reply (B1h).
struct Status {
  std::array<char, 7> version{};
  Mode mode = Mode::on_request;
  bool defective = false;
  std::array<uint16_t, 8> pollution{};
  uint16_t turn_us = 0;  ///< of a 1/90 of a turn
  uint8_t measuring_mode = 0;
  Variant variant;
  uint32_t baud = 0;  ///< 0: a code that is not known
  uint8_t address = 0;
  bool millimetres = false, laser_on = false;
};

// Commands, to the LMS with address 0.
Telegram command(Command command);
Telegram switch_mode(Mode mode);  ///< all but installation, which wants the password
Telegram enter_installation();
/// 9600, 19200, 38400 or 500000.
Telegram switch_baud(uint32_t baud);
Telegram request_scan();
Telegram switch_variant(const Variant& variant);
Telegram write_configuration(const Configuration& configuration);
Telegram keep_baud(bool keep);

/// The rates that switch_baud() knows.
inline constexpr std::array<uint32_t, 4> kBauds{500000, 38400, 19200, 9600};

/// A reply with these data, and the status byte behind them.
Telegram reply(Reply code, std::span<const uint8_t> data, uint8_t status);
/// 152 data bytes of a status reply; those that Status lacks are 0.
std::array<uint8_t, 152> status_data(const Status& status);

// Of a telegram's payload; nothing if it is another one, or too short.
std::optional<Reply> reply_code(std::span<const uint8_t> payload);
inline uint8_t status_byte(std::span<const uint8_t> payload) { return payload.back(); }
std::optional<Status> read_status(std::span<const uint8_t> payload);
std::optional<Configuration> read_configuration(std::span<const uint8_t> payload);
/// Of the error list: the number of the first entry that still holds, 0 where there is none.
std::optional<uint8_t> read_error(std::span<const uint8_t> payload);
/// What an error number means, as a sentence; a literal.
const char* error_text(uint8_t number);
/// The text of a power-on or type reply.
std::string_view read_text(std::span<const uint8_t> payload);
/// Of mode and variant replies and of configuration_written: what was asked for was done.
bool read_success(std::span<const uint8_t> payload);
std::optional<Variant> read_variant(std::span<const uint8_t> payload);
/// Rate that a mode byte asks for.
std::optional<uint32_t> baud_of_mode(uint8_t mode);

/// Bits 0..2 of the status byte.
enum class Severity : uint8_t { ok, info, warning, error, fatal };
inline Severity severity(uint8_t status) { return static_cast<Severity>(status & 7); }
/// Bits 6 and 7: measured values are implausible, the front pane is dirty.
inline constexpr uint8_t kImplausible = 0x40, kPolluted = 0x80;

}  // namespace takt::lms200
