// SPDX-License-Identifier: Apache-2.0
// The codec of the LMS 2xx against golden vectors, both ways.
#include <doctest/doctest.h>

#include <cmath>

#include <cstdio>
#include <map>

#include "hal/laser/lms200/commands.hpp"
#include "tests/unit/lms200/telegrams.hpp"

using namespace takt::lms200;
using namespace takt::test;

namespace {

bool is_command(std::span<const uint8_t> telegram) { return telegram[1] == 0; }

/// The payload of the one telegram that the bytes are; nothing if they are anything else.
std::vector<uint8_t> payload_of(std::span<const uint8_t> telegram) {
  Parser parser = is_command(telegram) ? Parser::of_commands() : Parser::of_replies();
  std::vector<uint8_t> payload;
  size_t events = 0;
  parse(parser, telegram, [&](const Event& event) {
    ++events;
    if (event.kind == EventKind::telegram) payload = copy_of(event.payload);
  });
  return events == 1 && !parser.begun() ? payload : std::vector<uint8_t>{};
}

std::span<const uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

}  // namespace

TEST_CASE("every golden telegram is taken, and is made again from its payload, bit by bit") {
  size_t commands = 0, replies = 0;
  const auto check = [&](std::string_view name, const std::vector<uint8_t>& bytes) {
    INFO(name);
    const auto payload = payload_of(bytes);
    REQUIRE_FALSE(payload.empty());
    CHECK(copy_of(Telegram(bytes[1], payload).bytes()) == bytes);
    ++(is_command(bytes) ? commands : replies);
    if (const auto scan = read_scan(payload)) CHECK(copy_of(scan_telegram(*scan).bytes()) == bytes);
  };
  for (const auto& [name, hex] : kLms200Telegrams) check(name, bytes_of_hex(hex));
  for (const auto& [name, hex] : kLms200ShortScans) check(name, bytes_of_hex(hex));
  for (const GoldenScan& rule : kLms200Scans) {
    const auto bytes = golden_scan(rule.name);
    check(rule.name, bytes);
    CHECK(read_u16(bytes, 5) == rule.head);
    CHECK(read_u16(bytes, bytes.size() - 2) == rule.crc);
  }
  std::printf("LMS 200 golden vectors, both ways: %zu commands, %zu replies and scans\n", commands, replies);
  CHECK(commands + replies == 51 + 8 + 12);
}

TEST_CASE("each command is the golden one") {
  Configuration factory, alternative;
  std::copy_n(golden("cmd_set_config_default").begin() + 5, 34, factory.bytes.begin());
  std::copy_n(golden("cmd_set_config_alt").begin() + 5, 34, alternative.bytes.begin());
  Configuration far = factory, centimetres = factory;
  far.set(0x06, true);
  centimetres.set(0x00, false);
  const std::map<std::string_view, Telegram> made{
      {"cmd_reset", command(Command::reset)},
      {"cmd_install_mode", enter_installation()},
      {"cmd_diag_mode", switch_mode(Mode::diagnosis)},
      {"cmd_stream_all", switch_mode(Mode::stream)},
      {"cmd_on_request", switch_mode(Mode::on_request)},
      {"cmd_stream_interlaced", switch_mode(Mode::stream_partial)},
      {"cmd_baud_9600", switch_baud(9600)},
      {"cmd_baud_19200", switch_baud(19200)},
      {"cmd_baud_38400", switch_baud(38400)},
      {"cmd_baud_500000", switch_baud(500000)},
      {"cmd_request_scan", request_scan()},
      {"cmd_status", command(Command::status)},
      {"cmd_errors", command(Command::errors)},
      {"cmd_type", command(Command::type)},
      {"cmd_variant_100_100", switch_variant({100, 100})},
      {"cmd_variant_100_50", switch_variant({100, 50})},
      {"cmd_variant_100_25", switch_variant({100, 25})},
      {"cmd_variant_180_100", switch_variant({180, 100})},
      {"cmd_variant_180_50", switch_variant({180, 50})},
      {"cmd_variant_180_25_illegal", switch_variant({180, 25})},
      {"cmd_baud_not_permanent", keep_baud(false)},
      {"cmd_baud_permanent", keep_baud(true)},
      {"cmd_get_config", command(Command::read_configuration)},
      {"cmd_set_config_default", write_configuration(factory)},
      {"cmd_set_config_alt", write_configuration(alternative)},
      {"cmd_set_config_32m", write_configuration(far)},
      {"cmd_set_config_cm", write_configuration(centimetres)},
  };
  for (const auto& [name, telegram] : made) {
    INFO(name);
    CHECK(copy_of(telegram.bytes()) == golden(name));
  }
}

TEST_CASE("each reply is the golden one, and says what it says") {
  const auto text = bytes_of("LMS200;301063;V02.10 ");
  const std::vector<uint8_t> done{0}, refused{1}, errors{3, 0x1D, 2, 0x12, 0x81, 0x2D};
  const std::vector<uint8_t> variant{1, 180, 0, 50, 0}, no_variant{0, 180, 0, 50, 0};
  const auto made = [](Reply code, std::span<const uint8_t> data, uint8_t status = 0x10) {
    return copy_of(reply(code, data, status).bytes());
  };
  CHECK(made(Reply::power_on, text) == golden("rsp_power_on"));
  CHECK(made(Reply::type, text) == golden("rsp_type"));
  CHECK(made(Reply::reset, {}) == golden("rsp_reset_confirm"));
  CHECK(made(Reply::not_permitted, {}) == golden("rsp_incorrect_command"));
  CHECK(made(Reply::mode, done) == golden("rsp_mode_ok"));
  CHECK(made(Reply::mode, refused) == golden("rsp_mode_bad_password"));
  CHECK(made(Reply::mode, done, 0x92) == golden("rsp_status_byte_pollution"));
  CHECK(made(Reply::errors, {}) == golden("rsp_no_errors"));
  CHECK(made(Reply::errors, errors) == golden("rsp_error_list"));
  CHECK(made(Reply::variant, variant) == golden("rsp_variant_180_50"));
  CHECK(made(Reply::variant, no_variant) == golden("rsp_variant_rejected"));

  CHECK(read_text(payload_of(golden("rsp_power_on"))) == "LMS200;301063;V02.10 ");
  CHECK(read_text(payload_of(golden("rec_ba_1"))) == "LMS200;S18063;V02.19 ");
  CHECK(read_text(payload_of(golden("rsp_mode_ok"))).empty());
  for (const char* good : {"rsp_mode_ok", "rsp_variant_180_50", "rsp_config_accepted", "rec_f7_3", "rec_a0_0"})
    CHECK_MESSAGE(read_success(payload_of(golden(good))), good);
  for (const char* bad :
       {"rsp_mode_bad_password", "rsp_mode_fault", "rsp_variant_rejected", "rsp_config_rejected", "rsp_type"})
    CHECK_MESSAGE(!read_success(payload_of(golden(bad))), bad);
  CHECK(read_variant(payload_of(golden("rsp_variant_rejected"))) == Variant{180, 50});
  CHECK(severity(status_byte(payload_of(golden("rsp_mode_ok")))) == Severity::ok);
  CHECK(severity(status_byte(payload_of(golden("rsp_status_byte_pollution")))) == Severity::warning);
  CHECK(severity(status_byte(payload_of(golden("scan_status_error")))) == Severity::error);
}

TEST_CASE("configuration and status of a recorded scanner") {
  const auto recorded = read_configuration(payload_of(golden("rec_f4_4")));
  REQUIRE(recorded);
  CHECK(recorded->measuring_mode() == 0x04);
  CHECK(recorded->millimetres());
  CHECK(recorded->availability() == 0);
  CHECK(read_configuration(payload_of(golden("rec_f7_3")))->bytes == recorded->bytes);
  CHECK(copy_of(write_configuration(*recorded).bytes()) == golden("rec_77_2"));
  CHECK_FALSE(read_configuration(payload_of(golden("rsp_type"))));

  const auto status = read_status(payload_of(golden("rec_b1_5")));
  REQUIRE(status);
  CHECK(std::string_view(status->version.data(), 7) == "V02.19 ");
  CHECK(status->mode == Mode::on_request);
  CHECK_FALSE(status->defective);
  CHECK(status->pollution[0] == 0x192);
  CHECK(status->turn_us == 148);
  CHECK(status->measuring_mode == 0x04);
  CHECK(status->variant == Variant{180, 50});
  CHECK(status->baud == 38400);
  CHECK(status->millimetres);
  CHECK(read_status(payload_of(golden("rec_b1_6")))->mode == Mode::installation);
  CHECK_FALSE(read_status(payload_of(golden("rsp_type"))));
  for (const char* name : {"rec_b1_5", "rec_b1_6", "rsp_status"}) {
    const Status read = *read_status(payload_of(golden(name)));
    const auto made = reply(Reply::status, status_data(read), 0x10);
    const Status again = *read_status(payload_of(made.bytes()));
    CHECK(again.variant == read.variant);
    CHECK(again.baud == read.baud);
    CHECK(again.pollution == read.pollution);
    CHECK(again.turn_us == read.turn_us);
  }
}

TEST_CASE("a checksum that a manual misprints is none") {
  auto install = golden("cmd_install_mode"), power_on = golden("rsp_power_on");
  install[install.size() - 2] = 0x5F;
  install[install.size() - 1] = 0xB2;
  power_on.back() = 0x56;
  CHECK(payload_of(install).empty());
  CHECK(payload_of(power_on).empty());
}

TEST_CASE("the error list: what still holds comes first; a list that is cut tells nothing more") {
  const auto error_of = [](std::vector<uint8_t> list) {
    const Telegram telegram = reply(Reply::errors, list, 0x13);
    return read_error(telegram.bytes().subspan(kHeader, list.size() + 2));
  };
  CHECK(error_of({0}) == 0);
  CHECK(error_of({1, 0x83, 5}) == 0);  // over
  CHECK(error_of({3, 0x83, 5, 2, 18, 3, 29}) == 18);
  CHECK(error_of({200, 0x83, 5}) == 0);
  CHECK(error_of({1, 3}) == 0);
  CHECK_FALSE(read_error(std::vector<uint8_t>{0xB1, 1, 2, 18, 0x10}));
  CHECK(std::string_view(error_text(5)).find("dazzled") != std::string_view::npos);
  CHECK(std::string_view(error_text(22)).find("clean it") != std::string_view::npos);
  CHECK(std::string_view(error_text(200)).find("in error") != std::string_view::npos);
}

TEST_CASE("values, flags and special values of a scan") {
  const auto flags = payload_of(golden("scan_flags"));
  const auto scan = read_scan(flags);
  REQUIRE(scan);
  REQUIRE(scan->beams() == 5);
  const uint8_t expected[] = {1, 2, 4, 7, 0};  // field A, field B, dazzled, all three, none
  for (size_t i = 0; i < 5; ++i) {
    const Beam beam = read_beam(scan->word(i), 13);
    CHECK(beam.flags == expected[i]);
    CHECK(beam.echo == Echo::valid);
    CHECK(beam.distance == 1234 + i);
    const bool dazzled = (expected[i] & 4) != 0;
    const float range = range_m(scan->word(i), 0, true);
    if (dazzled) CHECK(std::isnan(range));
    else CHECK(range == doctest::Approx(1.234 + 0.001 * static_cast<double>(i)));
  }
  const auto special = payload_of(golden("scan_overflow"));
  const auto values = read_scan(special);
  REQUIRE(values);
  const Echo echoes[] = {Echo::none,       Echo::dazzled,      Echo::overflow, Echo::noisy,
                         Echo::read_error, Echo::out_of_range, Echo::valid,    Echo::dazzled};
  for (size_t i = 0; i < 8; ++i) CHECK(read_beam(values->word(i), 13).echo == echoes[i]);
  CHECK(range_m(values->word(6), 0, true) == doctest::Approx(8.182));
  CHECK(range_m(values->word(0), 0, true) == 0);
  CHECK(range_m(values->word(5), 0, true) == 0);  // farther than can be measured
  for (const size_t blind : {1, 2, 3, 4, 7}) CHECK(std::isnan(range_m(values->word(blind), 0, true)));
  CHECK(read_beam(0x1FF9, 13).echo == Echo::unknown);
  CHECK(read_beam(0x3FFB, 14).echo == Echo::noisy);
  CHECK(read_beam(0x7FF6, 15).echo == Echo::valid);
  CHECK(read_beam(0x7FF7, 15).echo == Echo::out_of_range);

  const auto centimetres = payload_of(golden("scan_cm_unit"));
  const auto far = read_scan(centimetres);
  REQUIRE(far);
  CHECK_FALSE(far->millimetres);
  CHECK(range_m(far->word(2), 0, false) == doctest::Approx(81.82));
  CHECK(std::isnan(range_m(1000, 0x3F, true)));  // reflectivity is no distance
}

TEST_CASE("scans that are no scans") {
  auto payload = payload_of(golden("scan_cm_unit"));
  CHECK(read_scan(payload));
  CHECK_FALSE(read_scan(std::span(payload).first(payload.size() - 1)));
  CHECK_FALSE(read_scan(std::span(payload).first(3)));
  CHECK_FALSE(read_scan({}));
  payload[1] = 4;  // beams
  CHECK_FALSE(read_scan(payload));
  payload[1] = 3;
  payload[2] = 0x80;  // a unit that does not exist
  CHECK_FALSE(read_scan(payload));
  const auto with_indices = payload_of(golden_scan("scan_indices_181"));
  const auto indices = read_scan(with_indices);
  REQUIRE(indices);
  CHECK(indices->indices == Scan::Indices{7, 200});
}
