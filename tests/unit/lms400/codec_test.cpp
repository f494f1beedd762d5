// SPDX-License-Identifier: Apache-2.0
// The codec of the LMS 400 against golden vectors, both ways, and against streams that are cut, joined and damaged.
#include <doctest/doctest.h>

#include <cstdio>

#include "tests/unit/lms400/frames.hpp"
#include "tests/unit/lms400/golden.hpp"

using namespace takt::lms400;
using namespace takt::test;

TEST_CASE("every golden frame is taken, and is made again from its payload, bit by bit") {
  for (const GoldenFrame& golden : kLms400Texts) {
    INFO(golden.name);
    const Frame frame(bytes_of(golden.text));
    CHECK(frame.bytes().size() == golden.bytes);
    CHECK(frame.bytes().back() == golden.checksum);
    CHECK(text_of(payload_of(frame.bytes())) == golden.text);
  }
  for (const GoldenHex& golden : kLms400Measurements) {
    INFO(golden.name);
    const auto bytes = bytes_of_hex(golden.hex);
    const auto payload = payload_of(bytes);
    const auto measurement = read_measurement(payload);
    REQUIRE(measurement);
    CHECK(written(*measurement) == bytes);
  }
  // 280 beams of distance 900 + (7 i mod 1800) and remission 3 i mod 256.
  std::vector<uint8_t> beams;
  for (unsigned i = 0; i < 280; ++i) {
    const unsigned distance = 900 + 7 * i % 1800;
    beams.insert(beams.end(),
                 {static_cast<uint8_t>(distance), static_cast<uint8_t>(distance >> 8), static_cast<uint8_t>(3 * i)});
  }
  const Measurement m{Format::distance_and_remission, 1, 550'000, 2500, 360, 1, 0, 255, beams, 4};
  CHECK(written(m).size() == 887);
  CHECK(written(m).back() == 0x8E);
}

TEST_CASE("commands have the golden texts") {
  const auto text = [](std::string_view name) {
    for (const GoldenFrame& golden : kLms400Texts)
      if (golden.name == name) return golden.text;
    return std::string_view();
  };
  CHECK(kStop == text("stop"));
  CHECK(kLogin == text("login_user3"));
  CHECK(kRun == text("run"));
  CHECK(kSendDistances == text("req_dist"));
  CHECK(configure_scan({360, 0.25, 55, 70}) == text("scanconfig_360_025"));
  CHECK(configure_scan({500, 0.5, 55, 70}) == text("scanconfig_500_050"));
  CHECK(name_of(kLogin) == "SetAccessMode");
}

TEST_CASE("answers") {
  const auto result = read_answer(bytes_of("sAN mSCsetscanconfig 00000000 43B40000 3E800000 0000000A"));
  REQUIRE(result);
  CHECK(result->kind == Kind::result);
  CHECK(result->name == "mSCsetscanconfig");
  CHECK(read_hex(result->word(0)) == 0u);
  CHECK(read_float_bits(result->word(1)) == 360.0f);
  CHECK(read_float_bits(result->word(2)) == 0.25f);
  CHECK(read_hex(result->word(3)) == 10u);
  CHECK(result->word(4).empty());
  CHECK(read_answer(bytes_of("sMA Run"))->kind == Kind::accepted);
  CHECK(read_answer(bytes_of("sWA FLsel"))->name == "FLsel");
  CHECK(read_hex(read_answer(bytes_of("sFA FF"))->word(0)) == 0xFFu);
  CHECK(read_hex(read_answer(bytes_of("sFA 0003"))->word(0)) == 3u);
  CHECK_FALSE(read_answer(bytes_of("sMN Run")));
  CHECK_FALSE(read_answer({}));
  CHECK_FALSE(read_hex(""));
  CHECK_FALSE(read_hex("1G"));
  CHECK_FALSE(read_hex("123456789"));
}

TEST_CASE("values of a measurement") {
  const auto payload = payload_of(bytes_of_hex(kLms400Measurements[0].hex));
  const auto m = read_measurement(payload);
  REQUIRE(m);
  CHECK(m->format == Format::distance_and_remission);
  CHECK(m->first_tdeg == 550'000);
  CHECK(m->step_tdeg == 2500);
  CHECK(m->rate_hz == 360);
  CHECK(m->count() == 5);
  CHECK(m->distance(0) == 700);
  CHECK(m->distance(4) == 0);  // none
  CHECK(m->remission(0) == 10);
  CHECK(m->remission(3) == 40);
  CHECK(m->number == 0x1234);
}

TEST_CASE("measurements that contradict themselves are none") {
  const auto good = payload_of(bytes_of_hex(kLms400Measurements[1].hex));
  REQUIRE(read_measurement(good));
  const auto with = [&](size_t at, uint8_t value) {
    auto changed = good;
    changed[at] = value;
    return read_measurement(changed).has_value();
  };
  CHECK_FALSE(with(0, 0x23));  // format
  CHECK_FALSE(with(0, 0x20));  // another size of a beam
  CHECK_FALSE(with(7, 0x7F));  // an angle beyond the field
  CHECK_FALSE(with(7, 0xFF));  // a negative one
  CHECK_FALSE(with(6, 0x13));  // beams that lead out of it
  CHECK_FALSE(with(10, 5));    // more beams than there are
  CHECK_FALSE(read_measurement(std::span(good).first(good.size() - 1)));
  CHECK_FALSE(read_measurement({}));
}

TEST_CASE("streams give the same events however they are cut") {
  size_t index = 0;
  for (const GoldenHex& golden : kLms400Streams) {
    INFO(golden.name);
    const auto bytes = bytes_of_hex(golden.hex);
    const Texts& expected = kStreamEvents[index++];
    CHECK(events_in(bytes) == expected);
    for (const size_t piece : {1, 2, 3, 5, 8, 61}) CHECK(events_in(bytes, piece) == expected);
  }
}

TEST_CASE("the length is bounded, and any number of 02 may stand before a frame") {
  const auto frame = copy_of(Frame(bytes_of("sMA Run")).bytes());
  CHECK(events_in(bytes_of_hex("0202020200001001") + frame) == Texts{"error", "sMA"});
  CHECK(events_in(bytes_of_hex("0202020200000000") + frame) == Texts{"error", "sMA"});
  CHECK(events_in(std::vector<uint8_t>(1000, kStx) + frame) == Texts{"sMA"});
  std::vector<uint8_t> many;
  for (int i = 0; i < 3000; ++i) many = many + frame;
  CHECK(events_in(many).size() == 3000);
}
