// SPDX-License-Identifier: Apache-2.0
#include "hal/head/head_messages.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <set>

#include "tests/unit/head/golden_messages.hpp"

using namespace takt;
using namespace takt::can;
using namespace takt::test;

TEST_CASE("head messages: every golden frame is encoded and decoded bit by bit") {
  std::set<std::string_view> seen;
  for (const auto& golden : golden_frames()) {
    const Message& message = message_of(golden.message);
    seen.insert(golden.message);
    CHECK(message.id == golden.id);
    CHECK(message.is_protected == (golden.counter >= 0));
    check_golden(std::string(golden.name), message, golden.counter, golden.values, golden.data);
  }
  CHECK(golden_frames().size() == 34);
  CHECK(seen.size() == head::messages().size());
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
