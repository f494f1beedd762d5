// SPDX-License-Identifier: Apache-2.0
// A driver of a V4L2 camera and its double, in virtual time.
#pragma once
#include <doctest/doctest.h>

#include "hal/camera/v4l2_camera.hpp"
#include "hal/camera/video_double.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::v4l2 {

using test::kMs;

inline StereoRig small_rig() {
  StereoRig rig;
  rig.width = 16;
  rig.height = 6;
  rig.channels = 1;
  rig.rectified = false;
  return rig;
}

inline V4l2CameraSettings settings_of(FrameFormat format, Mosaic mosaic = Mosaic::none) {
  V4l2CameraSettings settings;
  settings.path = "/dev/video-double";
  settings.rig = small_rig();
  settings.layout.format = format;
  settings.layout.mosaic = mosaic;
  return settings;
}

inline VideoDouble::Settings double_of(const V4l2CameraSettings& settings, const std::string& trigger_line = "") {
  FrameLayout layout = settings.layout;
  layout.width = settings.rig.width;
  layout.height = settings.rig.height;
  VideoDouble::Settings camera;
  camera.width = static_cast<uint32_t>(layout.frame_width());
  camera.height = static_cast<uint32_t>(layout.height);
  camera.code = four_characters(layout.format);
  camera.bytes_per_line = static_cast<uint32_t>(layout.row_bytes()) + 4;  // padded
  camera.frame_bytes = camera.bytes_per_line * camera.height;
  camera.rate = settings.rate;
  camera.trigger_line = trigger_line;
  return camera;
}

inline std::unique_ptr<FrameTrigger> trigger_of(VideoDouble& device, const std::string& line, const Clock& clock) {
  if (line.empty()) return nullptr;
  return std::make_unique<FrameTrigger>(FrameTriggerSettings{"/dev/chip-double", line}, device.wire().chip(), clock);
}

inline void fill(uint32_t k, int64_t, std::span<uint8_t> frame) {
  for (size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<uint8_t>(i * 7 + k * 13);
}

/// As the driver tells it of small_rig().
inline StereoFormat format_of(const V4l2CameraSettings& settings) {
  StereoFormat format;
  format.width = settings.rig.width;
  format.height = settings.rig.height;
  format.channels = settings.layout.channels();
  return format;
}

struct Bench {
  VirtualClock clock{5'000'000'000};
  V4l2CameraSettings settings;
  VideoDouble device;
  V4l2Camera driver;  ///< has a trigger if the double has
  test::GuardedImage left, right;
  StereoFrame frame;

  explicit Bench(V4l2CameraSettings s = settings_of(FrameFormat::y16), const std::string& trigger_line = "")
      : settings(std::move(s)),
        device(double_of(settings, trigger_line), fill, clock),
        driver("camera", settings, device.device(), clock, trigger_of(device, trigger_line, clock)),
        left(format_of(settings)),
        right(left) {}
  void start() {
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(clock.now_ns()).has_value());
  }
  /// After so many milliseconds, with a pulse if it is triggered.
  StereoFrame read(int64_t after_ms = 67) {
    clock.advance_to(clock.now_ns() + after_ms * kMs);
    driver.trigger(clock.now_ns());
    return frame = driver.read(left.view(), right.view(), clock.now_ns() + 60 * kMs);
  }
};

}  // namespace takt::v4l2
