// SPDX-License-Identifier: Apache-2.0
// The driver of the camera head against its double, byte by byte through a socket, in virtual time.
#include <doctest/doctest.h>

#include "hal/head/can_head.hpp"
#include "hal/head/head_double.hpp"
#include "tests/unit/can/bench.hpp"

using namespace takt;
using namespace takt::head;

TEST_CASE("can head conforms") {
  test::CanBench<CanHead, HeadDouble> bench(CanHeadSettings{});
  test::check_camera_head(bench.driver, [&](int64_t at_ns) { bench.pace(at_ns); });
}
