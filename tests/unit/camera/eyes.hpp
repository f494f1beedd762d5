// SPDX-License-Identifier: Apache-2.0
// Frames of two images, taken apart.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hal/camera/frame_codec.hpp"

namespace takt::test {

using namespace v4l2;

/// 4 x 2 pixels of each sensor, as in golden/bumblebee_frames.json.
inline constexpr const char* kRight = "0A0B0C0D14151617";
inline constexpr const char* kLeft = "646566676E6F7071";
inline constexpr const char* kCentre = "C8C9CACBD2D3D4D5";

struct Eyes {
  int rows = 0;
  std::vector<uint8_t> left, right;
};

inline Eyes eyes_of(std::span<const uint8_t> frame, FrameLayout layout) {
  const auto size = static_cast<size_t>(layout.width * layout.height * layout.channels());
  Eyes eyes{0, std::vector<uint8_t>(size, 0xA5), std::vector<uint8_t>(size, 0xA5)};
  if (layout.bytes_per_line == 0) layout.bytes_per_line = layout.row_bytes();
  eyes.rows = split(frame, layout, {eyes.left.data(), layout.width, layout.height, layout.channels()},
                    {eyes.right.data(), layout.width, layout.height, layout.channels()});
  return eyes;
}

inline FrameLayout layout_of(FrameFormat format, int left, int right) {
  FrameLayout layout;
  layout.format = format;
  layout.width = 4;
  layout.height = 2;
  layout.left = left;
  layout.right = right;
  return layout;
}

}  // namespace takt::test
