// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/interaction/console.hpp"
#include "hal/interaction/script.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/unit/interaction/fifo.hpp"

using namespace takt;

TEST_CASE("script and console conform") {
  ScriptedPerson script({{2 * test::kDevicePeriod, "goal cup_1.level=full"}, {4 * test::kDevicePeriod, "stop"}},
                        [](int64_t epoch_ns) { return epoch_ns; });
  test::check_interaction(script);
  const test::Fifo fifo;
  Console console("person", {fifo.in, fifo.out});
  test::check_interaction(console, [&](int64_t at_ns) {
    if (at_ns == test::kDeviceEpoch + 2 * test::kDevicePeriod) fifo.write("goal cup_1.level=full\n");
    if (at_ns == test::kDeviceEpoch + 4 * test::kDevicePeriod) fifo.write("stop\n");
  });
}
