// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/recorded/golden.hpp"
#include "tests/unit/lms400/frames.hpp"

using namespace takt::lms400;
using namespace takt::test;

TEST_CASE("the whole collection of golden vectors, bit by bit") {
  const auto all = golden("lms400_telegrams.json");
  size_t texts = 0, measurements = 0, streams = 0;
  for (const auto& entry : all["telegrams"]) {
    INFO(entry["id"].get<std::string>());
    const auto bytes = bytes_of_hex(entry["hex"].get<std::string>());
    CHECK(text_of(payload_of(bytes)) == entry["ascii"].get<std::string>());
    CHECK(copy_of(Frame(bytes_of(entry["ascii"].get<std::string>())).bytes()) == bytes);
    ++texts;
  }
  for (const auto& entry : all["scans"]) {
    INFO(entry["id"].get<std::string>());
    const auto bytes = bytes_of_hex(entry["hex"].get<std::string>());
    const auto payload = payload_of(bytes);
    const auto m = read_measurement(payload);
    REQUIRE(m);
    CHECK(written(*m) == bytes);
    ++measurements;
  }
  for (const auto& entry : all["streams"]) {
    CHECK(events_in(bytes_of_hex(entry["hex"].get<std::string>())) == kStreamEvents[streams]);
    ++streams;
  }
  std::printf("lms400_telegrams.json: %zu texts and %zu measurements both ways, %zu streams\n", texts, measurements,
              streams);
}
