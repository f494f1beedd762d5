// SPDX-License-Identifier: Apache-2.0
// What every StereoCamera must do, whatever is behind it. `make` gives a fresh closed camera that uses the clock.
#pragma once
#include <doctest/doctest.h>

#include <functional>
#include <memory>
#include <vector>

#include "hal/camera/stereo_camera.hpp"
#include "rt/time/clock.hpp"

namespace takt::test {

/// A view with a margin of guard bytes on all sides.
struct GuardedImage {
  static constexpr int kMargin = 5;
  static constexpr uint8_t kGuard = 0xA5;
  int width, height, channels;
  std::vector<uint8_t> bytes;
  explicit GuardedImage(const StereoFormat& f) : width(f.width), height(f.height), channels(f.channels) {
    bytes.assign(static_cast<size_t>((width + 2 * kMargin) * channels) * static_cast<size_t>(height + 2 * kMargin),
                 kGuard);
  }
  ImageView<uint8_t> view() {
    const ptrdiff_t stride = ptrdiff_t{width + 2 * kMargin} * channels;
    return {bytes.data() + kMargin * stride + kMargin * channels, width, height, channels, stride};
  }
  bool guards_hold() {
    size_t inside = 0, guards = 0;
    for (int y = -kMargin; y < height + kMargin; ++y) {
      for (int x = -kMargin; x < width + kMargin; ++x) {
        const bool in = view().contains(x, y);
        for (int c = 0; c < channels; ++c) (in ? inside : guards) += in || view().at(x, y, c) == kGuard ? 1 : 0;
      }
    }
    return inside + guards == bytes.size();
  }
  bool untouched() const {
    for (const uint8_t b : bytes) {
      if (b != kGuard) return false;
    }
    return true;
  }
};

/// Both images of one exposure, left before right.
inline std::vector<uint8_t> exposure(StereoCamera& camera, int64_t at_ns) {
  GuardedImage left(camera.format()), right(camera.format());
  camera.trigger(at_ns);
  REQUIRE(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::ok);
  left.bytes.insert(left.bytes.end(), right.bytes.begin(), right.bytes.end());
  return left.bytes;
}

using MakeCamera = std::function<std::unique_ptr<StereoCamera>(const Clock&)>;

inline void check_stereo_camera(const MakeCamera& make) {
  constexpr int64_t kEpoch = 5'000'000'000, kPeriod = 66'666'667;
  VirtualClock clock(kEpoch);
  auto camera = make(clock);
  CHECK_FALSE(camera->start(kEpoch).has_value());  // not open yet
  REQUIRE(camera->open().has_value());
  REQUIRE(camera->open().has_value());  // opening twice changes nothing
  const StereoFormat format = camera->format();
  REQUIRE(format.width > 0);
  REQUIRE(format.height > 0);
  CHECK((format.channels == 1 || format.channels == 3));
  CHECK(format.rectified == (format.camera.focal_px > 0));
  if (format.rectified) CHECK(format.camera.baseline_m > 0);

  GuardedImage left(format), right(format);
  CHECK(camera->read(left.view(), right.view(), INT64_MAX).status == ReadStatus::no_data);  // not started
  REQUIRE(camera->start(kEpoch).has_value());

  // An exposure after the deadline is no data, and leaves the views alone; it is not lost.
  camera->trigger(kEpoch);
  CHECK(camera->read(left.view(), right.view(), kEpoch - 1).status == ReadStatus::no_data);
  CHECK(left.untouched());
  CHECK(right.untouched());
  StereoFrame first = camera->read(left.view(), right.view(), kEpoch + kPeriod);
  REQUIRE(first.status == ReadStatus::ok);
  CHECK(first.frame_number == 0);
  CHECK(first.stamp_ns == kEpoch);
  CHECK(left.guards_hold());
  CHECK(right.guards_hold());
  CHECK_FALSE(left.untouched());
  CHECK_FALSE(right.untouched());
  CHECK(left.bytes != right.bytes);
  const std::vector<uint8_t> seen = left.bytes;

  // One exposure, one frame.
  CHECK(camera->read(left.view(), right.view(), kEpoch + kPeriod).status == ReadStatus::no_data);

  int64_t previous = first.stamp_ns;
  for (uint32_t k = 1; k < 3; ++k) {
    clock.advance_to(kEpoch + k * kPeriod);
    camera->trigger(kEpoch + k * kPeriod);
    const StereoFrame frame = camera->read(left.view(), right.view(), INT64_MAX);
    REQUIRE(frame.status == ReadStatus::ok);
    CHECK(frame.frame_number == k);
    CHECK(frame.stamp_ns > previous);
    previous = frame.stamp_ns;
  }

  // From the same epoch everything repeats, bit for bit.
  camera->stop();
  CHECK(camera->read(left.view(), right.view(), INT64_MAX).status == ReadStatus::no_data);
  REQUIRE(camera->start(kEpoch).has_value());
  camera->trigger(kEpoch);
  first = camera->read(left.view(), right.view(), INT64_MAX);
  CHECK(first.status == ReadStatus::ok);
  CHECK(first.frame_number == 0);
  CHECK(left.bytes == seen);
  camera->stop();
  camera->close();
  CHECK_FALSE(camera->start(kEpoch).has_value());
}

/// Free-running: frames appear as the clock reaches their stamps, each once.
inline void check_free_running_camera(const MakeCamera& make) {
  VirtualClock clock(1'000'000'000);
  auto camera = make(clock);
  REQUIRE(camera->open().has_value());
  REQUIRE(camera->start(2'000'000'000).has_value());
  GuardedImage left(camera->format()), right(camera->format());
  CHECK(camera->read(left.view(), right.view(), INT64_MAX).status == ReadStatus::no_data);  // before the epoch
  clock.advance_to(2'000'000'000);
  const StereoFrame first = camera->read(left.view(), right.view(), INT64_MAX);
  CHECK(first.status == ReadStatus::ok);
  CHECK(first.stamp_ns == 2'000'000'000);
  CHECK(camera->read(left.view(), right.view(), INT64_MAX).status == ReadStatus::no_data);
  clock.advance_to(2'300'000'000);
  const StereoFrame second = camera->read(left.view(), right.view(), INT64_MAX);
  CHECK(second.status == ReadStatus::ok);
  CHECK(second.stamp_ns > first.stamp_ns);
  CHECK(second.stamp_ns <= clock.now_ns());
}

/// A camera at a rate of its own, or one with a trigger line, whatever its device: `pace` lets its world go on until an
/// instant of the clock.
inline void check_streaming_camera(StereoCamera& camera, const Clock& clock,
                                   const std::function<void(int64_t at_ns)>& pace) {
  CHECK_FALSE(camera.start(clock.now_ns()).has_value());  // not open yet
  REQUIRE(camera.open().has_value());
  REQUIRE(camera.open().has_value());  // opening twice changes nothing
  const StereoFormat format = camera.format();
  REQUIRE(format.width > 0);
  REQUIRE(format.height > 0);
  const bool triggered = format.rate_hz == 0;
  const StampLaw law = camera.stamp_law({});
  CHECK((format.channels == 1 || format.channels == 3));
  const auto period_ns = static_cast<int64_t>(1e9 / (triggered ? 15 : format.rate_hz));
  for (int run = 0; run < 2; ++run) {
    GuardedImage left(format), right(format);
    CHECK(camera.read(left.view(), right.view(), clock.now_ns()).status == ReadStatus::no_data);  // not started
    CHECK(left.untouched());
    CHECK(right.untouched());
    const int64_t started_ns = clock.now_ns();
    REQUIRE(camera.start(started_ns).has_value());
    int64_t previous_ns = started_ns - 1;
    uint32_t frames = 0, number = 0;
    for (int k = 0; k < 60 && frames < 10; ++k) {
      pace(clock.now_ns() + period_ns);
      const int64_t released_ns = clock.now_ns();
      if (triggered) camera.trigger(released_ns);
      const StereoFrame frame = camera.read(left.view(), right.view(), clock.now_ns() + period_ns);
      if (frame.status == ReadStatus::no_data) continue;
      REQUIRE(frame.status == ReadStatus::ok);
      CHECK(frame.stamp_ns > previous_ns);
      CHECK(frame.stamp_ns <= clock.now_ns());
      if (law.unknown.empty()) CHECK(released_ns - frame.stamp_ns <= law.lag_ns());
      CHECK((frames == 0 || frame.frame_number > number));
      previous_ns = frame.stamp_ns;
      number = frame.frame_number;
      ++frames;
    }
    CHECK(frames == 10);
    CHECK(left.guards_hold());
    CHECK(right.guards_hold());
    CHECK_FALSE(left.untouched());
    CHECK(left.bytes != right.bytes);
    camera.stop();
  }
  camera.close();
  CHECK_FALSE(camera.start(clock.now_ns()).has_value());
}

}  // namespace takt::test
