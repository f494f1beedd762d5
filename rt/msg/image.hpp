// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/image.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// What a camera driver found out about a frame at capture (bits of `health`).
namespace image_health {
constexpr uint32_t saturated = 1, dark = 2, blurred = 4, unchanging = 8, partial = 16;
}

/// One 8-bit image. Capacity: width, height, channels.
struct Image {
  static constexpr std::string_view type_name = "image";
  int32_t width = 0, height = 0, channels = 0;
  uint32_t health = 0;
  CameraModel camera;
  Array<uint8_t> pixels;  ///< interleaved, BGR if three channels

  ImageView<uint8_t> view() { return {pixels.data(), width, height, channels}; }
  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, channels}; }
  bool sound() const { return image_fits(width, height, channels, pixels.capacity); }
  void show(Viewer& to) const {
    to.picture(view());
    if (camera.focal_px > 0) to.camera({camera, width, height});
  }
  TAKT_FIELDS(Image, (width, "px"), (height, "px"), (channels, "1"), (health, ""), (camera),
              (pixels, "1", capacity.pixels() * capacity.channels))
};

/// Two 8-bit images of one exposure. Raw from a camera, rectified (camera.focal_px > 0) from the stereo node.
/// Capacity: width, height, channels.
struct StereoPair {
  static constexpr std::string_view type_name = "stereo_pair";
  int32_t width = 0, height = 0, channels = 0;
  uint32_t health = 0;
  uint32_t frame_number = 0;  ///< counted by the device; a gap is a frame lost before the host saw it
  CameraModel camera;
  Transform sensor_in_robot;   ///< left camera, head at rest; identity: unknown
  Array<uint8_t> left, right;  ///< interleaved, BGR if three channels

  ImageView<uint8_t> left_view() { return {left.data(), width, height, channels}; }
  ImageView<uint8_t> right_view() { return {right.data(), width, height, channels}; }
  ImageView<const uint8_t> left_view() const { return {left.data(), width, height, channels}; }
  ImageView<const uint8_t> right_view() const { return {right.data(), width, height, channels}; }
  bool sound() const { return image_fits(width, height, channels, left.capacity); }
  void show(Viewer& to) const {
    to.picture(left_view(), "left");
    to.picture(right_view(), "right");
    if (!(camera.focal_px > 0)) return;
    to.camera({camera, width, height}, "left");
    to.camera({camera, width, height, camera.baseline_m}, "right");
  }
  TAKT_FIELDS(StereoPair, (width, "px"), (height, "px"), (channels, "1"), (health, ""), (frame_number, "1"), (camera),
              (sensor_in_robot), (left, "1", capacity.pixels() * capacity.channels),
              (right, "1", capacity.pixels() * capacity.channels))
};

}  // namespace takt
