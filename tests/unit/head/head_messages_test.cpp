// SPDX-License-Identifier: Apache-2.0
#include "hal/head/head_messages.hpp"

#include <doctest/doctest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "hal/can/end_to_end.hpp"
#include "tests/conformance/dbc_file.hpp"
#include "tests/unit/can/golden_frames.hpp"

using namespace takt;
using namespace takt::can;

namespace {

const Message& message_of(std::string_view name) {
  for (const Message& message : head::messages()) {
    if (message.name == name) return message;
  }
  FAIL("no message ", std::string(name));
  return head::messages().front();
}

Frame frame_of(const Message& message, std::string_view data) {
  const auto bytes = test::bytes_of(data);
  Frame frame{message.id, static_cast<uint8_t>(bytes.size()), {}};
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

/// Made from its values it is these bytes, and read it has these values; all other signals are 0.
template <class Values>
void check_golden(const std::string& name, const Message& message, int counter, const Values& golden,
                  std::string_view data) {
  INFO(name);
  std::array<double, kMostSignals> values{}, read{};
  for (const auto& [signal, value] : golden) {
    size_t i = 0;
    while (i < message.signals.size() && message.signals[i].name != signal) ++i;
    REQUIRE(i < message.signals.size());
    values[i] = value;
  }
  Frame frame = encode(message, values);
  if (message.is_protected) EndToEndSender(static_cast<uint8_t>(counter)).protect(message, frame);
  const Frame expected = frame_of(message, data);
  CHECK(frame == expected);
  CHECK(decode(message, expected, read));
  for (size_t i = 0; i < message.signals.size(); ++i) CHECK(read[i] == doctest::Approx(values[i]).epsilon(1e-12));
}

}  // namespace

TEST_CASE("head messages: every golden frame is encoded and decoded bit by bit") {
  std::set<std::string_view> seen;
  for (const auto& golden : test::golden_frames()) {
    const Message& message = message_of(golden.message);
    seen.insert(golden.message);
    CHECK(message.id == golden.id);
    CHECK(message.is_protected == (golden.counter >= 0));
    check_golden(std::string(golden.name), message, golden.counter, golden.values, golden.data);
  }
  CHECK(test::golden_frames().size() == 34);
  CHECK(seen.size() == head::messages().size());
}

TEST_CASE("head messages: the whole collection of golden vectors, bit by bit") {
  const auto file = test::reference("golden/can_head.json");
  if (!file) return;
  std::ifstream stream(*file);
  const auto all = nlohmann::json::parse(stream);
  const auto text = [](const nlohmann::json& value) { return value.get<std::string>(); };
  for (const auto& golden : all["frames"]) {
    const Message& message = message_of(text(golden["msg"]));
    CHECK(message.id == std::stoul(text(golden["can_id"]), nullptr, 16));
    check_golden(text(golden["id"]), message, golden.value("cnt", -1),
                 golden["phys"].get<std::map<std::string, double>>(), text(golden["data"]));
  }
  for (const auto& golden : all["negative"]) {
    INFO(text(golden["id"]));
    const Message& message = message_of(text(golden["msg"]));
    const Frame frame = frame_of(message, text(golden["data"]));
    const EndToEndStatus status = EndToEndReceiver().check(message, frame);
    std::array<double, kMostSignals> read{};
    CHECK((status == EndToEndStatus::wrong_crc) == (golden["expect"] == "WRONGCRC"));
    CHECK((status == EndToEndStatus::wrong_crc || status == EndToEndStatus::invalid || !decode(message, frame, read)));
  }
  size_t received = 0;
  for (const auto& golden : all["sequences"]) {
    INFO(text(golden["id"]));
    EndToEndReceiver receiver;
    for (size_t i = 0; i < golden["frames"].size(); ++i, ++received) {
      const std::string line = text(golden["frames"][i]);
      const Message& message = head::messages()[head::kPosStatus];
      // Where the collection refers to its note, the receiver has resynchronised on consecutive frames.
      const std::string expected = text(golden["expect"][i]) == "see note" ? "OK" : text(golden["expect"][i]);
      CHECK(test::word(receiver.check(message, frame_of(message, line.substr(line.find('#') + 1)))) == expected);
    }
  }
  std::printf("can_head.json: %zu frames both ways, %zu refused, %zu frames of %zu sequences judged\n",
              all["frames"].size(), all["negative"].size(), received, all["sequences"].size());
}

TEST_CASE("head messages: a value that cannot be is refused, although its CRC is right") {
  for (const auto& refused : test::kRefusedFrames) {
    if (refused.reason != test::RefusedFrame::range) continue;
    std::array<double, kMostSignals> values;
    values.fill(-7);
    const Message& message = head::messages()[head::kPosStatus];
    CHECK_FALSE(decode(message, frame_of(message, refused.data), values));
    for (const double value : values) CHECK(value == -7);
  }
}

TEST_CASE("head messages: values beyond their range are sent as the nearest, NaN as the nearest to 0") {
  std::array<double, head::Setpoint::count> values{}, read{};
  values[head::Setpoint::mode] = 1;
  values[head::Setpoint::pan] = 500;
  values[head::Setpoint::tilt] = -1e300;
  values[head::Setpoint::speed] = std::numeric_limits<double>::quiet_NaN();
  values[head::Setpoint::acceleration] = std::numeric_limits<double>::infinity();
  const Message& message = head::messages()[head::kSetpoint];
  CHECK(decode(message, encode(message, values), read));
  CHECK(read == std::array{1.0, 120.0, -45.0, 0.0, 2000.0});
}

TEST_CASE("head messages: a page of the limits leaves the values of the others") {
  const Message& message = head::messages()[head::kLimits];
  std::array<double, head::Limits::count> values{};
  for (const char* page : {"DF0020D1E02EC800", "2C116CEE9411C800", "DB22204E983A1027"})
    CHECK(decode(message, frame_of(message, page), values));
  CHECK(values == std::array{2.0, -120.0, 120.0, 2.0, -45.0, 45.0, 2.0, 200.0, 150.0, 1000.0});
  CHECK_FALSE(decode(message, frame_of(message, "0030000000000000"), values));  // page 3
}

TEST_CASE("head messages: the table is that of the DBC file") {
  if (const auto file = test::reference("golden/ace_head.dbc")) test::check_table(head::messages(), *file);
}
