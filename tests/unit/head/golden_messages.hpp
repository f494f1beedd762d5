// SPDX-License-Identifier: Apache-2.0
// Messages of the camera head against their golden bytes.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "hal/can/end_to_end.hpp"
#include "hal/head/head_messages.hpp"
#include "tests/unit/can/golden_frames.hpp"

namespace takt::test {

using namespace can;

inline const Message& message_of(std::string_view name) {
  for (const Message& message : head::messages()) {
    if (message.name == name) return message;
  }
  FAIL("no message ", std::string(name));
  return head::messages().front();
}

inline Frame frame_of(const Message& message, std::string_view data) {
  const auto bytes = bytes_of(data);
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

}  // namespace takt::test
