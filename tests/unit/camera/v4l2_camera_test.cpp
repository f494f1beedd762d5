// SPDX-License-Identifier: Apache-2.0
// The driver of a V4L2 camera against its double, call by call, in virtual time.
#include <doctest/doctest.h>
#include <sys/mman.h>

#include "hal/camera/stereo_camera_node.hpp"
#include "rt/msg/image.hpp"
#include "tests/unit/camera/v4l2_bench.hpp"

using namespace takt;
using namespace takt::v4l2;

using test::kMs;

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

TEST_CASE("v4l2 camera: how old its frames can be is told without it, and a slower device breaks the word") {
  auto settings = settings_of(FrameFormat::grey);
  const StampLaw nothing_said = Bench(settings).driver.stamp_law({});
  CHECK(nothing_said.latency_ns == 133'333'333 + 1);  // two rounded periods: exposure and transfer
  CHECK(nothing_said.period_ns == 66'666'667);
  settings.longest_exposure_s = 0.01;
  settings.transfer_s = 0.02;
  const StampLaw said = Bench(settings).driver.stamp_law({});
  CHECK(said.lag_ns() == 30 * kMs + 66'666'667);
  CHECK(said.wait_ns == 0);
  const StampLaw triggered = Bench(settings, "shutter").driver.stamp_law({});
  CHECK(triggered.lag_ns() == 0);
  CHECK(triggered.wait_ns == 30 * kMs);

  VirtualClock clock(5'000'000'000);
  auto slower = settings;
  slower.rate = Rate{10, 1};
  VideoDouble device(double_of(slower), fill, clock);
  StereoCameraNode node(std::make_unique<V4l2Camera>("camera", settings, device.device(), clock));
  node.declare();
  CHECK(node.broken_declaration() == "");
  REQUIRE(node.device().open().has_value());
  CHECK(node.broken_declaration().find("can be 130.000000 ms old") != std::string::npos);
  CHECK(node.stamp_law({}).lag_ns() == said.lag_ns());  // what was counted on stays the same

  settings.transfer_s = 0;  // a period, which is longer there
  VideoDouble shot(double_of(slower, "shutter"), fill, clock);
  StereoCameraNode waiting(
      std::make_unique<V4l2Camera>("camera", settings, shot.device(), clock, trigger_of(shot, "shutter", clock)));
  waiting.declare();
  REQUIRE(waiting.device().open().has_value());
  CHECK(waiting.broken_declaration().find("can come after 110.000000 ms") != std::string::npos);
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

TEST_CASE("v4l2 camera: with a trigger line it conforms, and each frame has number and stamp of its pulse") {
  Bench bench(settings_of(FrameFormat::y16), "camera_trigger");
  test::check_streaming_camera(bench.driver, bench.clock, [&](int64_t at_ns) { bench.clock.advance_to(at_ns); });
  CHECK(bench.driver.counters().untriggered == 0);
  CHECK(bench.driver.format().rate_hz == 0);

  bench.start();
  for (uint32_t k = 0; k < 20; ++k) {
    bench.device.misbehave(k == 7 || k == 8 ? Misbehaviour::silent : Misbehaviour::none);
    bench.read();
    if (k == 7 || k == 8) {
      CHECK(bench.frame.status == ReadStatus::no_data);
      continue;
    }
    REQUIRE(bench.frame.status == ReadStatus::ok);
    CHECK(bench.frame.frame_number == k);
    CHECK(bench.frame.stamp_ns == bench.clock.now_ns());
  }
  CHECK(bench.driver.counters().missing == 2);
  CHECK(bench.device.wire().rises(0) == 40);  // of the suite's two runs, too
}

TEST_CASE("v4l2 camera: no pulse comes before its instant, nor twice") {
  Bench bench(settings_of(FrameFormat::y16), "camera_trigger");
  bench.start();
  const auto read = [&] { return bench.driver.read(bench.left.view(), bench.right.view(), INT64_MAX).status; };
  const int64_t at_ns = bench.clock.now_ns() + 10 * kMs;
  bench.driver.trigger(at_ns);
  CHECK(read() == ReadStatus::no_data);
  CHECK(bench.device.wire().rises(0) == 0);
  bench.clock.advance_to(at_ns);
  CHECK(read() == ReadStatus::ok);
  CHECK(read() == ReadStatus::no_data);
  CHECK(bench.device.wire().rises(0) == 1);
  CHECK_FALSE(bench.device.wire().level(0));
}

TEST_CASE("v4l2 camera: a trigger that is too fast gives every second frame, and the others are missing") {
  Bench bench(settings_of(FrameFormat::y16), "camera_trigger");
  bench.start();
  int frames = 0;
  for (int k = 0; k < 40; ++k) frames += bench.read(40).status == ReadStatus::ok ? 1 : 0;
  CHECK(frames == 20);
  CHECK(bench.driver.counters().missing == 19);  // what comes after the last one is not known yet
}

TEST_CASE("v4l2 camera: frames of no pulse are left out, and the reason is told") {
  Bench bench;  // exposes at its own rate, whatever its driver's line does
  gpio::ChipDouble chip({"spare"}, bench.clock);
  V4l2Camera driver("camera", bench.settings, bench.device.device(), bench.clock,
                    std::make_unique<FrameTrigger>(FrameTriggerSettings{"chip", "0"}, chip.chip(), bench.clock));
  REQUIRE(driver.open().has_value());
  REQUIRE(driver.start(bench.clock.now_ns()).has_value());
  CHECK(std::string(driver.trouble()).empty());
  for (int k = 0; k < 5; ++k) {
    bench.clock.advance_to(bench.clock.now_ns() + 67 * kMs);
    CHECK(driver.read(bench.left.view(), bench.right.view(), bench.clock.now_ns()).status == ReadStatus::no_data);
  }
  CHECK(driver.counters().untriggered == 6);
  CHECK(driver.counters().frames == 0);
  CHECK(std::string(driver.trouble()).find("stamp_delay") != std::string::npos);
}

TEST_CASE("v4l2 camera: a trigger line that is lost is a loss of the camera, and comes back with it") {
  Bench bench(settings_of(FrameFormat::y16), "camera_trigger");
  bench.start();
  CHECK(bench.read().status == ReadStatus::ok);
  bench.device.wire().misbehave(Misbehaviour::unplugged);
  CHECK(bench.read().status == ReadStatus::disconnected);
  CHECK_FALSE(bench.driver.restart(bench.clock.now_ns()));
  bench.device.wire().misbehave(Misbehaviour::none);
  CHECK(bench.driver.restart(bench.clock.now_ns()));
  CHECK(bench.read().status == ReadStatus::ok);
}

TEST_CASE("v4l2 camera: a trigger line that cannot be had is told with chip and line") {
  Bench bench(settings_of(FrameFormat::y16), "camera_trigger");
  const auto error = [&](const char* line) {
    V4l2Camera driver("camera", bench.settings, bench.device.device(), bench.clock,
                      std::make_unique<FrameTrigger>(FrameTriggerSettings{"/dev/chip", line},
                                                     bench.device.wire().chip(), bench.clock));
    const auto opened = driver.open();
    return opened ? std::string() : opened.error().text();
  };
  CHECK(error("strobe").find("/dev/chip: trigger line `strobe` cannot be had: No such file") != std::string::npos);
  bench.start();
  CHECK(error("camera_trigger").find("gpioinfo names it") != std::string::npos);
}

TEST_CASE("v4l2 camera: an exported buffer is the frame that was delivered, and stays so until the next one is") {
  auto settings = settings_of(FrameFormat::y16);
  settings.dmabuf = true;
  Bench bench(settings);
  bench.start();
  CHECK(bench.driver.exported().size() == 4);
  CHECK(bench.driver.lent() == -1);
  const size_t bytes = 36 * 6;
  const auto matches = [&] {
    const int buffer = bench.driver.exported()[static_cast<size_t>(bench.driver.lent())].get();
    void* const memory = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, buffer, 0);
    REQUIRE(memory != MAP_FAILED);
    const std::span frame(static_cast<const uint8_t*>(memory), bytes);
    size_t wrong = 0;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 16; ++x)
        wrong += bench.left.view().at(x, y) != frame[static_cast<size_t>(y * 36 + 2 * x + 1)] ? 1 : 0;
    }
    munmap(memory, bytes);
    return wrong == 0;
  };
  for (int k = 0; k < 10; ++k) {
    REQUIRE(bench.read().status == ReadStatus::ok);
    CHECK(matches());
    bench.clock.advance_to(bench.clock.now_ns() + 500 * kMs);  // more exposures than there are buffers
    CHECK(matches());
  }
  bench.driver.stop();
  CHECK(bench.driver.lent() == -1);
  bench.driver.close();
  CHECK(bench.driver.exported().empty());

  auto without = double_of(settings);
  without.exports = false;
  VideoDouble device(without, fill, bench.clock);
  V4l2Camera driver("camera", settings, device.device(), bench.clock);
  const auto opened = driver.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().text().find("exports no buffer: ") != std::string::npos);
  CHECK(opened.error().text().find("leave `dmabuf` out") != std::string::npos);
}
