// SPDX-License-Identifier: Apache-2.0
// The driver of the mobile base against its double, byte by byte through a socket, in virtual time.
#include <doctest/doctest.h>

#include "hal/base/base_double.hpp"
#include "hal/base/can_base.hpp"
#include "tests/unit/can/bench.hpp"

using namespace takt;
using namespace takt::base;

TEST_CASE("can base conforms") {
  test::CanBench<CanBase, BaseDouble> bench(CanBaseSettings{});
  test::check_mobile_base(bench.driver, true, [&](int64_t at_ns) { bench.pace(at_ns); });
}
