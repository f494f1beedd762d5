// SPDX-License-Identifier: Apache-2.0
// The driver of a V4L2 camera against its double, call by call, in virtual time.
#include <doctest/doctest.h>

#include "tests/unit/camera/v4l2_bench.hpp"

using namespace takt;
using namespace takt::v4l2;

TEST_CASE("v4l2 camera conforms, in every format") {
  for (const auto& settings :
       {settings_of(FrameFormat::y16), settings_of(FrameFormat::y8i), settings_of(FrameFormat::rgb3),
        settings_of(FrameFormat::yuyv), settings_of(FrameFormat::grey), settings_of(FrameFormat::y16, Mosaic::gbrg)}) {
    Bench bench(settings);
    test::check_streaming_camera(bench.driver, bench.clock, [&](int64_t at_ns) { bench.clock.advance_to(at_ns); });
    CHECK(bench.driver.counters().damaged == 0);
    CHECK(bench.driver.counters().missing == 0);
  }
}
