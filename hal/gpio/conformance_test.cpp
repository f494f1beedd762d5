// SPDX-License-Identifier: Apache-2.0
// The driver against a double of the chip, call by call, in virtual time.
#include <doctest/doctest.h>

#include "tests/conformance/devices.hpp"
#include "tests/unit/gpio/bench.hpp"

using namespace takt;
using namespace takt::gpio;

TEST_CASE("gpio lines conform") {
  for (const int64_t debounce_ns : {int64_t{0}, 5 * kMs}) {
    Bench bench(debounce_ns);
    // Each change is given the time that it takes to count.
    test::check_digital_lines(
        bench.driver, 0,
        [&](uint32_t, bool level) {
          bench.chip.set(kStop, level);
          bench.clock.advance_to(bench.clock.now_ns() + 10 * kMs);
        },
        [&](int64_t at_ns) { bench.clock.advance_to(std::max(at_ns, bench.clock.now_ns())); });
  }
}
