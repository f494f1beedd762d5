// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/way.hpp"

#include <doctest/doctest.h>

#include <stdexcept>

using namespace takt::machines;

TEST_CASE("A train of packets says how fast the way is") {
  CHECK(train_mbit_s(65, 1250, 640'000) == doctest::Approx(1000));  // 64 of 10,000 bits in 0.64 ms
}

TEST_CASE("The line for the graph is on the safe side, and without a bandwidth that is not known") {
  Way way;
  way.there_and_back.max_us = 1'200;
  way.clock.error_ns = 900'000;
  CHECK(network_line(way) == "network: {latency: 2ms, clock_error: 2ms}");
  way.sends_mbit_s = 941.7, way.receives_mbit_s = 88.9;
  CHECK(network_line(way) == "network: {latency: 2ms, clock_error: 2ms, bandwidth: 88Mbit}");
}

TEST_CASE("What is no address is said") {
  CHECK_THROWS_WITH_AS(measure_way({"robot", 7390, 0}),
                       "`robot` is no IP address; give the one of the other machine, such as 10.0.0.2",
                       std::runtime_error);
}
