// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: cameras behind the kernel's v4l2loopback and vivid.
#include <doctest/doctest.h>
#include <linux/dma-buf.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hal/camera/loopback_double.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/hil/guest.hpp"

using namespace takt;
using test::from_environment;
using test::kMs;
using test::level_of;
using test::shell;
using test::sleep_until;

namespace {

uint8_t byte_of_frame(uint32_t number, size_t i) { return static_cast<uint8_t>(i == 0 ? number : i * 7 + number); }

v4l2::V4l2CameraSettings camera_settings(const char* path, v4l2::FrameFormat format) {
  v4l2::V4l2CameraSettings settings;
  settings.path = path;
  settings.rig.width = format == v4l2::FrameFormat::y16 ? 640 : 320;  // of a frame of 640
  settings.rig.height = 480;
  settings.rig.rectified = false;
  settings.layout.format = format;
  if (settings.layout.side_by_side()) std::swap(settings.layout.left, settings.layout.right);
  return settings;
}

/// What feeds v4l2loopback with frames for that driver. There is nothing to be opened before the first of them.
std::unique_ptr<v4l2::LoopbackDouble> feeder_of(const v4l2::V4l2CameraSettings& settings, Rate rate,
                                                v4l2::VideoDouble::Fill fill) {
  v4l2::LoopbackDouble::Settings fed{settings.path, settings.layout, rate};
  fed.layout.width = settings.rig.width;
  fed.layout.height = settings.rig.height;
  auto feeder = std::make_unique<v4l2::LoopbackDouble>(fed, std::move(fill));
  REQUIRE(feeder->plug_in().has_value());
  feeder->run_to(MonotonicClock().now_ns());
  return feeder;
}

}  // namespace

TEST_CASE("hil: stereo_camera on v4l2loopback, bit by bit") {
  MonotonicClock clock;
  const auto settings = camera_settings("/dev/video0", v4l2::FrameFormat::y16);
  uint32_t fed_number = 0;
  const auto feeder = feeder_of(settings, settings.rate, [&](uint32_t number, int64_t, std::span<uint8_t> frame) {
    fed_number = number;
    for (size_t i = 0; i < frame.size(); ++i) frame[i] = byte_of_frame(number, i);
  });
  v4l2::V4l2Camera camera("camera", settings, std::make_unique<v4l2::KernelVideoDevice>(), clock);
  const auto pace = [&](int64_t at_ns) {
    feeder->run_to(at_ns);
    sleep_until(at_ns);
  };
  test::check_streaming_camera(camera, clock, pace);

  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(clock.now_ns()).has_value());
  test::GuardedImage left(camera.format()), right(camera.format());
  int compared = 0;
  for (int k = 0; k < 20; ++k) {
    pace(clock.now_ns() + 67 * kMs);
    const StereoFrame frame = camera.read(left.view(), right.view(), clock.now_ns() + 67 * kMs);
    if (frame.status != ReadStatus::ok) continue;
    const uint32_t number = right.view().at(0, 0);  // byte 0 of the frame
    size_t wrong = 0;
    for (int y = 0; y < 480; ++y) {
      for (int x = 0; x < 640; ++x) {
        const auto i = static_cast<size_t>(2 * (y * 640 + x));
        wrong += right.view().at(x, y) != byte_of_frame(number, i) ? 1 : 0;
        wrong += left.view().at(x, y) != byte_of_frame(number, i + 1) ? 1 : 0;
      }
    }
    CHECK(wrong == 0);
    CHECK(number == (fed_number & 0xFF));
    ++compared;
  }
  CHECK(compared >= 15);
}

TEST_CASE("hil: stereo_camera on vivid, side by side, and its errors are told") {
  MonotonicClock clock;
  v4l2::V4l2Camera camera("camera", camera_settings("/dev/video30", v4l2::FrameFormat::grey),
                          std::make_unique<v4l2::KernelVideoDevice>(), clock);
  test::check_streaming_camera(camera, clock, [](int64_t) {});

  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(clock.now_ns()).has_value());
  test::GuardedImage left(camera.format()), right(camera.format());
  const auto until = [&](ReadStatus status) {
    for (int k = 0; k < 30; ++k) {
      const StereoFrame frame = camera.read(left.view(), right.view(), clock.now_ns() + 200 * kMs);
      if (frame.status == status) return true;
      if (frame.status == ReadStatus::disconnected) camera.restart(clock.now_ns());
    }
    return false;
  };
  const auto control = [](const std::string& set) { shell("v4l2-ctl -d /dev/video30 -c " + set); };
  REQUIRE(until(ReadStatus::ok));
  bool told = false;
  for (int k = 0; k < 5 && !told; ++k) {  // where the guest is slow a newer frame may stand before the damaged one
    control("inject_v4l2_buf_flag_error=1");
    told = until(ReadStatus::partial);
  }
  CHECK(told);
  CHECK(until(ReadStatus::ok));
  const uint64_t missing = camera.counters().missing;
  control("percentage_of_dropped_buffers=60");
  for (int k = 0; k < 20; ++k) camera.read(left.view(), right.view(), clock.now_ns() + 200 * kMs);
  control("percentage_of_dropped_buffers=0");
  CHECK(camera.counters().missing > missing);
  control("inject_fatal_streaming_error=1");
  CHECK(until(ReadStatus::disconnected));
  CHECK(until(ReadStatus::ok));
  control("disconnect=1");
  CHECK(until(ReadStatus::disconnected));
  CHECK(until(ReadStatus::ok));
}

namespace {

/// A chip of the kernel; its only line leads to a camera, which exposes when it is high.
class WiredChip final : public gpio::LineChip {
 public:
  explicit WiredChip(std::function<void()> expose) : expose_(std::move(expose)) {}
  int open(const std::string& path) override { return chip_.open(path); }
  void close() override { chip_.close(); }
  std::optional<uint32_t> find(const std::string& name) override { return chip_.find(name); }
  int request_input(size_t slot, uint32_t offset) override { return chip_.request_input(slot, offset); }
  int request_output(size_t slot, uint32_t offset, bool level) override {
    return chip_.request_output(slot, offset, level);
  }
  int get(size_t slot, bool& level) override { return chip_.get(slot, level); }
  int set(size_t slot, bool level) override {
    const int error = chip_.set(slot, level);
    if (level && level_of("sim_gpio3") == "1") expose_();
    return error;
  }
  int next_event(size_t slot, gpio::LineEvent& event) override { return chip_.next_event(slot, event); }

 private:
  gpio::KernelLineChip chip_;
  std::function<void()> expose_;
};

}  // namespace

TEST_CASE("hil: stereo_camera on v4l2loopback, triggered through gpio-sim: each frame is of its pulse") {
  MonotonicClock clock;
  const auto settings = camera_settings("/dev/video0", v4l2::FrameFormat::y16);
  uint8_t exposures = 0;
  bool blind = false;
  const auto sensor = feeder_of(settings, Rate{1000, 1}, [&](uint32_t, int64_t, std::span<uint8_t> frame) {
    for (size_t i = 0; i < frame.size(); ++i) frame[i] = byte_of_frame(exposures, i);
  });
  const auto expose = [&] {
    ++exposures;
    if (!blind) sensor->run_to(clock.now_ns());
  };
  v4l2::FrameTriggerSettings line{from_environment("HIL_GPIO_CHIP"), "camera_trigger"};
  v4l2::V4l2Camera camera("camera", settings, std::make_unique<v4l2::KernelVideoDevice>(), clock,
                          std::make_unique<v4l2::FrameTrigger>(line, std::make_unique<WiredChip>(expose), clock));
  test::check_streaming_camera(camera, clock, sleep_until);

  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(clock.now_ns()).has_value());
  exposures = 0;
  test::GuardedImage left(camera.format()), right(camera.format());
  for (uint32_t k = 0; k < 20; ++k) {
    blind = k == 9;
    sleep_until(clock.now_ns() + 67 * kMs);
    const int64_t asked_ns = clock.now_ns();
    camera.trigger(asked_ns);
    const StereoFrame frame = camera.read(left.view(), right.view(), asked_ns + (blind ? 30 : 1000) * kMs);
    CHECK(exposures == k + 1);
    CHECK(level_of("sim_gpio3") == "0");
    CHECK(frame.status == (blind ? ReadStatus::no_data : ReadStatus::ok));
    if (frame.status != ReadStatus::ok) continue;
    CHECK(frame.frame_number == k);
    CHECK(frame.stamp_ns >= asked_ns);
    CHECK(right.view().at(0, 0) == k + 1);  // byte 0 of the frame
  }
  CHECK(camera.counters().missing == 1);
  gpio::GpioLines second("second", {.chip = line.chip, .outputs = {"camera_trigger"}},
                         std::make_unique<gpio::KernelLineChip>(), clock);
  CHECK_FALSE(second.open().has_value());  // it is the camera's
}

TEST_CASE("hil: stereo_camera on vivid exports its buffers, as DMABUFs that another process may read") {
  MonotonicClock clock;
  auto settings = camera_settings("/dev/video30", v4l2::FrameFormat::grey);
  settings.dmabuf = true;
  v4l2::V4l2Camera camera("camera", settings, std::make_unique<v4l2::KernelVideoDevice>(), clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(clock.now_ns()).has_value());
  test::GuardedImage left(camera.format()), right(camera.format());
  const auto differs = [&](int buffer) {  // in the other process: no checks there
    constexpr size_t kBytes = 640 * 480;
    void* const memory = mmap(nullptr, kBytes, PROT_READ, MAP_SHARED, buffer, 0);
    if (memory == MAP_FAILED) return 2;
    dma_buf_sync sync{DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ};
    if (ioctl(buffer, DMA_BUF_IOCTL_SYNC, &sync) != 0) return 3;  // is no DMABUF
    const auto* frame = static_cast<const uint8_t*>(memory);
    for (int y = 0; y < 480; ++y) {
      for (int x = 0; x < 320; ++x)
        if (frame[y * 640 + x] != left.view().at(x, y) || frame[y * 640 + 320 + x] != right.view().at(x, y)) return 1;
    }
    return 0;
  };
  int read = 0;
  for (int k = 0; k < 30 && read < 5; ++k) {
    if (camera.read(left.view(), right.view(), clock.now_ns() + 200 * kMs).status != ReadStatus::ok) continue;
    const int buffer = camera.exported()[static_cast<size_t>(camera.lent())].get();
    const pid_t reader = fork();
    REQUIRE(reader >= 0);
    if (reader == 0) _exit(differs(buffer));
    int status = -1;
    REQUIRE(waitpid(reader, &status, 0) == reader);
    CHECK(WEXITSTATUS(status) == 0);
    ++read;
  }
  CHECK(read == 5);

  settings = camera_settings("/dev/video0", v4l2::FrameFormat::y16);
  settings.dmabuf = true;
  const auto feeder = feeder_of(settings, settings.rate, [](uint32_t, int64_t, std::span<uint8_t>) {});
  v4l2::V4l2Camera without("camera", settings, std::make_unique<v4l2::KernelVideoDevice>(), clock);
  const auto opened = without.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().text().find("leave `dmabuf` out") != std::string::npos);
}
