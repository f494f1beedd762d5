// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/recorded/golden.hpp"
#include "tests/unit/camera/eyes.hpp"
#include "tests/unit/can/golden_frames.hpp"

using namespace takt;
using namespace takt::v4l2;
using namespace takt::test;

TEST_CASE("frame codec: the vectors are those of the reference") {
  const auto golden = test::golden("bumblebee_frames.json");
  const auto& planes = golden["planes"];
  CHECK(planes["right"] == kRight);
  CHECK(planes["left"] == kLeft);
  CHECK(planes["center"] == kCentre);
  size_t frames = 0;
  for (const auto& frame : golden["frames"]) {
    const bool three = frame["bytes_per_pixel"] == 3;
    for (int left = 0; left < (three ? 3 : 2); ++left) {
      for (int right = 0; right < (three ? 3 : 2); ++right) {
        if (left == right) continue;
        const Eyes eyes = eyes_of(bytes_of(frame["hex"].get<std::string>()),
                                  layout_of(three ? FrameFormat::rgb3 : FrameFormat::y16, left, right));
        const auto plane = [&](int byte) {
          return bytes_of(planes[frame["byte" + std::to_string(byte)].get<std::string>()].get<std::string>());
        };
        CHECK(eyes.left == plane(left));
        CHECK(eyes.right == plane(right));
      }
    }
    ++frames;
  }
  CHECK(frames == 4);
  for (const auto& size : golden["sizes"]) {
    const std::string camera = size["camera"];
    FrameLayout layout =
        layout_of(camera.find("three") == std::string::npos ? FrameFormat::y16 : FrameFormat::rgb3, 1, 0);
    layout.width = camera.find("XB3") == std::string::npos ? 640 : 1280;
    layout.height = layout.width * 3 / 4;
    layout.bytes_per_line = layout.row_bytes();
    CHECK(layout.bytes_per_line == size["bytesperline"]);
    CHECK(layout.image_bytes() == size["sizeimage"]);
  }
}
