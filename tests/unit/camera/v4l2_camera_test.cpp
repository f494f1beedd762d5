// SPDX-License-Identifier: Apache-2.0
// The driver of a V4L2 camera against its double, call by call, in virtual time.
#include "hal/camera/v4l2_camera.hpp"

#include <doctest/doctest.h>

#include "hal/camera/video_double.hpp"
#include "tests/conformance/stereo_camera.hpp"

using namespace takt;
using namespace takt::v4l2;

namespace {

constexpr int64_t kMs = 1'000'000;

StereoRig small_rig() {
  StereoRig rig;
  rig.width = 16;
  rig.height = 6;
  rig.channels = 1;
  rig.rectified = false;
  return rig;
}

V4l2CameraSettings settings_of(FrameFormat format, Mosaic mosaic = Mosaic::none) {
  V4l2CameraSettings settings;
  settings.path = "/dev/video-double";
  settings.rig = small_rig();
  settings.layout.format = format;
  settings.layout.mosaic = mosaic;
  return settings;
}

VideoDouble::Settings double_of(const V4l2CameraSettings& settings) {
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
  return camera;
}

void fill(uint32_t k, int64_t, std::span<uint8_t> frame) {
  for (size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<uint8_t>(i * 7 + k * 13);
}

/// As the driver tells it of small_rig().
StereoFormat format_of(const V4l2CameraSettings& settings) {
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
  V4l2Camera driver;
  test::GuardedImage left, right;
  StereoFrame frame;

  explicit Bench(V4l2CameraSettings s = settings_of(FrameFormat::y16))
      : settings(std::move(s)),
        device(double_of(settings), fill, clock),
        driver("camera", settings, device.device(), clock),
        left(format_of(settings)),
        right(left) {}
  void start() {
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(clock.now_ns()).has_value());
  }
  /// After so many milliseconds.
  StereoFrame read(int64_t after_ms = 67) {
    clock.advance_to(clock.now_ns() + after_ms * kMs);
    return frame = driver.read(left.view(), right.view(), clock.now_ns() + 60 * kMs);
  }
};

}  // namespace

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

TEST_CASE("v4l2 camera: pixels, stamps and numbers are the device's") {
  Bench bench;
  bench.start();
  const int64_t since_ns = bench.clock.now_ns();
  for (uint32_t k = 1; k <= 20; ++k) {
    bench.read();
    REQUIRE(bench.frame.status == ReadStatus::ok);
    CHECK(bench.frame.stamp_ns == Rate{15, 1}.release_ns(since_ns, k) / 1000 * 1000);
    std::vector<uint8_t> sent(36 * 6);
    fill(k, 0, sent);
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 16; ++x) {
        CHECK(bench.left.view().at(x, y) == sent[static_cast<size_t>(y * 36 + 2 * x + 1)]);
        CHECK(bench.right.view().at(x, y) == sent[static_cast<size_t>(y * 36 + 2 * x)]);
      }
    }
  }
  CHECK(bench.driver.counters().skipped == 1);  // the frame of the start waited, too
  CHECK(bench.driver.format().rate_hz == 15);
}

TEST_CASE("v4l2 camera: the newest of several is delivered, and what was lost shows in its number") {
  Bench bench;
  bench.start();
  bench.read(1);
  CHECK(bench.frame.frame_number == 0);
  bench.read(201);  // frames 1, 2, 3 wait
  CHECK(bench.frame.frame_number == 3);
  CHECK(bench.driver.counters().skipped == 2);
  bench.read(1000);  // 4..18: four buffers were there
  CHECK(bench.frame.frame_number == 7);
  bench.read();
  CHECK(bench.frame.frame_number == 19);
  CHECK(bench.driver.counters().missing == 11);
  CHECK(bench.read(1).status == ReadStatus::no_data);
}

TEST_CASE("v4l2 camera: each misbehaviour is told, and it works again when it ends") {
  struct Case {
    Misbehaviour how;
    ReadStatus status;
  };
  for (const Case& c :
       {Case{Misbehaviour::silent, ReadStatus::no_data}, Case{Misbehaviour::unplugged, ReadStatus::disconnected},
        Case{Misbehaviour::flagged, ReadStatus::partial}, Case{Misbehaviour::cut, ReadStatus::partial},
        Case{Misbehaviour::empty, ReadStatus::partial}, Case{Misbehaviour::io_error, ReadStatus::no_data},
        Case{Misbehaviour::end_of_stream, ReadStatus::disconnected},
        Case{Misbehaviour::queue_error, ReadStatus::disconnected}, Case{Misbehaviour::repeated, ReadStatus::no_data},
        Case{Misbehaviour::uncounted, ReadStatus::ok}, Case{Misbehaviour::unstamped, ReadStatus::ok},
        Case{Misbehaviour::frozen, ReadStatus::ok}}) {
    CAPTURE(static_cast<int>(c.how));
    Bench bench;
    bench.start();
    for (int k = 0; k < 3; ++k) bench.read();
    REQUIRE(bench.frame.status == ReadStatus::ok);
    const StereoFrame before = bench.frame;
    bench.device.misbehave(c.how);
    CHECK(bench.read().status == c.status);
    CHECK(bench.left.guards_hold());
    if (c.status == ReadStatus::ok) {
      CHECK(bench.frame.frame_number > before.frame_number);
      CHECK(bench.frame.stamp_ns > before.stamp_ns);
    }
    CHECK((bench.frame.health & image_health::partial) ==
          (c.status == ReadStatus::partial ? image_health::partial : 0));
    // Whoever gives nothing for long is lost, whatever he says.
    for (int k = 0; k < 20; ++k) {
      if (bench.read().status == ReadStatus::disconnected) break;
    }
    const bool lost = bench.frame.status == ReadStatus::disconnected;
    CHECK(lost == (c.status == ReadStatus::no_data || c.status == ReadStatus::disconnected));
    CHECK((bench.read().status == ReadStatus::disconnected) == lost);  // until it is restarted
    if (c.how == Misbehaviour::unplugged) CHECK_FALSE(bench.driver.restart(bench.clock.now_ns()));
    bench.device.misbehave(Misbehaviour::none);
    if (lost) CHECK(bench.driver.restart(bench.clock.now_ns()));
    bench.read();
    CHECK(bench.read().status == ReadStatus::ok);
  }
}

TEST_CASE("v4l2 camera: exposure and gain reach the device in its steps") {
  auto settings = settings_of(FrameFormat::grey);
  settings.exposure_s = 0.004;
  settings.gain = 7;
  Bench bench(settings);
  bench.start();
  CHECK(bench.device.exposure_steps() == 40);
  CHECK(bench.device.gain_steps() == 7);
}

TEST_CASE("v4l2 camera: the stamp is that of the exposure's begin") {
  auto settings = settings_of(FrameFormat::grey);
  settings.stamp_delay_s = 0.010;
  Bench bench(settings);
  bench.start();
  const int64_t since_ns = bench.clock.now_ns();
  bench.read(140);
  CHECK(bench.frame.stamp_ns == Rate{15, 1}.release_ns(since_ns, 2) / 1000 * 1000 - 10 * kMs);
}

TEST_CASE("v4l2 camera: what it refuses is told with what the device offers") {
  const auto error = [](const V4l2CameraSettings& asked, const VideoDouble::Settings& has) {
    VirtualClock clock;
    VideoDouble device(has, fill, clock);
    V4l2Camera driver("camera", asked, device.device(), clock);
    CHECK_FALSE(driver.start(0).has_value());
    const auto opened = driver.open();
    REQUIRE_FALSE(opened.has_value());
    CHECK_FALSE(driver.restart(0));
    return opened.error().text();
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  const auto y16 = settings_of(FrameFormat::y16), grey = settings_of(FrameFormat::grey);
  CHECK(has(error(y16, double_of(grey)), "16 x 6 Y16  (setting `format`, and the rig); it offers: GREY"));
  auto large = double_of(y16);
  large.width = 640;
  CHECK(has(error(y16, large), "size of the rig"));
  auto uncontrolled = double_of(y16);
  uncontrolled.has_controls = false;
  auto exposed = y16;
  exposed.exposure_s = 0.01;
  CHECK(has(error(exposed, uncontrolled), "refuses `exposure`"));
  auto same = y16;
  same.layout.left = same.layout.right;
  CHECK(has(error(same, double_of(y16)), "use two of 0..1"));
  CHECK(has(error(settings_of(FrameFormat::yuyv, Mosaic::rggb), double_of(y16)), "leave `bayer` out"));

  VirtualClock clock;
  V4l2Camera absent("camera", y16, std::make_unique<KernelVideoDevice>(), clock);
  const auto opened = absent.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK_FALSE(opened.error().bad_input);
  CHECK(has(opened.error().text(), "/dev/video-double: cannot be opened"));
}

TEST_CASE("v4l2 camera: a camera that another program holds is told as busy") {
  Bench bench;
  bench.start();
  V4l2Camera second("second", bench.settings, bench.device.device(), bench.clock);
  const auto opened = second.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().text().find("fuser") != std::string::npos);
  bench.read();
  CHECK(bench.frame.status == ReadStatus::ok);  // the first one goes on
}
