// SPDX-License-Identifier: Apache-2.0
// The driver of FireWire cameras over a shim in the place of libdc1394, call by call, in virtual time. No camera was
// there.
#include <doctest/doctest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <map>

#include "hal/camera/iidc/iidc_driver.hpp"
#include "hal/camera/iidc/iidc_video_device.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "tests/unit/camera/v4l2_bench.hpp"

using namespace takt;
using namespace takt::iidc;
using v4l2::FrameFormat;

namespace {

constexpr uint64_t kGuid = 0x00b09d0100a1b2c3;
constexpr int64_t kRealOffset_ns = 1'700'000'000'000'000'000;  ///< CLOCK_REALTIME less the clock of the test

/// A Bumblebee on a bus: what the library would have asked of it, and the frames that it sends.
struct Shim {
  uint32_t width = 16, height = 6, cameras = 1, unit = 4, most = 4096;
  std::vector<dc1394color_coding_t> codings{DC1394_COLOR_CODING_MONO16, DC1394_COLOR_CODING_RAW16};
  bool bus_b = false, there = true;
  std::map<std::string, dc1394error_t> refuses;  ///< by call
  std::vector<std::string> asked;

  uint64_t guid = 0;
  uint32_t packet = 0, bytes_per_pixel = 2;
  bool sends = false, triggered = false;
  int captures = 0, open = 0, event = eventfd(0, EFD_NONBLOCK);
  std::deque<dc1394video_frame_t> ring;
  std::deque<std::vector<uint8_t>> images;
  uint32_t corrupt = UINT32_MAX;
  size_t in_hand = 0;
  dc1394camera_t camera{};
  dc1394camera_list_t list{};
  std::vector<dc1394camera_id_t> ids;

  Shim() { current = this; }
  ~Shim() {
    current = nullptr;
    close(event);
  }
  static Shim* current;

  dc1394error_t does(const std::string& call, const std::string& with = "") {
    asked.push_back(with.empty() ? call : call + " " + with);
    const auto refused = refuses.find(call);
    return refused == refuses.end() ? DC1394_SUCCESS : refused->second;
  }
  bool was_asked(const std::string& call) const { return std::find(asked.begin(), asked.end(), call) != asked.end(); }
  uint32_t image_bytes() const { return width * height * bytes_per_pixel; }
  uint32_t packets() const { return (image_bytes() + packet - 1) / packet; }

  /// A frame arrives whole at that instant; its bytes tell its number.
  void arrives(uint32_t k, int64_t at_ns) {
    images.emplace_back(image_bytes());
    for (size_t i = 0; i < images.back().size(); ++i) images.back()[i] = static_cast<uint8_t>(i * 7 + k * 13);
    dc1394video_frame_t frame{};
    frame.image = images.back().data();
    frame.image_bytes = image_bytes();
    frame.timestamp = static_cast<uint64_t>((at_ns + kRealOffset_ns) / 1000);
    frame.id = k;
    ring.push_back(frame);
    eventfd_write(event, 1);
  }
};
Shim* Shim::current = nullptr;
Shim& shim() { return *Shim::current; }

Dc1394Calls calls() {
  Dc1394Calls c;
  c.dc1394_new = [] { return ++shim().open, reinterpret_cast<dc1394_t*>(Shim::current); };
  c.dc1394_free = [](dc1394_t*) { --shim().open; };
  c.dc1394_camera_enumerate = [](dc1394_t*, dc1394camera_list_t** list) {
    shim().ids.assign(shim().cameras, {0, kGuid});
    shim().list = {shim().cameras, shim().ids.data()};
    *list = &shim().list;
    return shim().does("enumerate");
  };
  c.dc1394_camera_free_list = [](dc1394camera_list_t*) {};
  c.dc1394_camera_new = [](dc1394_t*, uint64_t guid) {
    shim().guid = guid;
    shim().camera.bmode_capable = shim().bus_b ? DC1394_TRUE : DC1394_FALSE;
    return shim().there ? &shim().camera : nullptr;
  };
  c.dc1394_camera_free = [](dc1394camera_t*) {};
  c.dc1394_camera_set_power = [](dc1394camera_t*, dc1394switch_t) { return DC1394_FUNCTION_NOT_SUPPORTED; };
  c.dc1394_video_set_operation_mode = [](dc1394camera_t*, dc1394operation_mode_t) { return shim().does("1394b"); };
  c.dc1394_video_set_iso_speed = [](dc1394camera_t*, dc1394speed_t speed) {
    return shim().does("speed", speed == DC1394_ISO_SPEED_800 ? "800" : "400");
  };
  c.dc1394_video_set_mode = [](dc1394camera_t*, dc1394video_mode_t mode) {
    return shim().does("mode", mode == DC1394_VIDEO_MODE_FORMAT7_3 ? "3" : "another");
  };
  c.dc1394_video_set_transmission = [](dc1394camera_t*, dc1394switch_t on) {
    shim().sends = on == DC1394_ON;
    return shim().does(on == DC1394_ON ? "send" : "be silent");
  };
  c.dc1394_format7_get_max_image_size = [](dc1394camera_t*, dc1394video_mode_t, uint32_t* width, uint32_t* height) {
    *width = shim().width, *height = shim().height;
    return DC1394_SUCCESS;
  };
  c.dc1394_format7_get_color_codings = [](dc1394camera_t*, dc1394video_mode_t, dc1394color_codings_t* all) {
    all->num = 0;
    for (const auto coding : shim().codings) all->codings[all->num++] = coding;
    return DC1394_SUCCESS;
  };
  c.dc1394_format7_set_roi = [](dc1394camera_t*, dc1394video_mode_t, dc1394color_coding_t coding, int32_t, int32_t,
                                int32_t, int32_t, int32_t) {
    shim().bytes_per_pixel = coding == DC1394_COLOR_CODING_RGB8 ? 3 : 2;
    return shim().does("roi");
  };
  c.dc1394_format7_get_packet_parameters = [](dc1394camera_t*, dc1394video_mode_t, uint32_t* unit, uint32_t* most) {
    *unit = shim().unit, *most = shim().most;
    return DC1394_SUCCESS;
  };
  c.dc1394_format7_set_packet_size = [](dc1394camera_t*, dc1394video_mode_t, uint32_t bytes) {
    shim().packet = bytes;
    return shim().does("packet", std::to_string(bytes));
  };
  c.dc1394_format7_get_total_bytes = [](dc1394camera_t*, dc1394video_mode_t, uint64_t* bytes) {
    *bytes = uint64_t{shim().packets()} * shim().packet;
    return DC1394_SUCCESS;
  };
  c.dc1394_feature_set_mode = [](dc1394camera_t*, dc1394feature_t, dc1394feature_mode_t) {
    return shim().does("manual");
  };
  c.dc1394_feature_set_value = [](dc1394camera_t*, dc1394feature_t feature, uint32_t value) {
    return shim().does(feature == DC1394_FEATURE_PAN ? "pan" : "gain", std::to_string(value));
  };
  c.dc1394_feature_set_absolute_control = [](dc1394camera_t*, dc1394feature_t, dc1394switch_t) {
    return shim().does("absolute");
  };
  c.dc1394_feature_set_absolute_value = [](dc1394camera_t*, dc1394feature_t, float value) {
    return shim().does("shutter", std::to_string(std::lround(value * 1e6F)));
  };
  c.dc1394_external_trigger_set_mode = [](dc1394camera_t*, dc1394trigger_mode_t) {
    return shim().does("trigger mode");
  };
  c.dc1394_external_trigger_set_source = [](dc1394camera_t*, dc1394trigger_source_t) {
    return shim().does("trigger source");
  };
  c.dc1394_external_trigger_set_polarity = [](dc1394camera_t*, dc1394trigger_polarity_t edge) {
    return shim().does("edge", edge == DC1394_TRIGGER_ACTIVE_HIGH ? "rising" : "falling");
  };
  c.dc1394_external_trigger_set_power = [](dc1394camera_t*, dc1394switch_t on) {
    shim().triggered = on == DC1394_ON;
    return shim().does("trigger", on == DC1394_ON ? "on" : "off");
  };
  c.dc1394_capture_setup = [](dc1394camera_t*, uint32_t, uint32_t) {
    return ++shim().captures, shim().does("capture");
  };
  c.dc1394_capture_stop = [](dc1394camera_t*) { return --shim().captures, shim().ring.clear(), DC1394_SUCCESS; };
  c.dc1394_capture_get_fileno = [](dc1394camera_t*) { return shim().event; };
  c.dc1394_capture_dequeue = [](dc1394camera_t*, dc1394capture_policy_t, dc1394video_frame_t** frame) {
    *frame = shim().ring.size() > shim().in_hand ? &shim().ring[shim().in_hand] : nullptr;
    if (*frame != nullptr) ++shim().in_hand;
    return shim().does("dequeue");
  };
  c.dc1394_capture_enqueue = [](dc1394camera_t*, dc1394video_frame_t*) {
    shim().ring.pop_front();
    --shim().in_hand;
    return DC1394_SUCCESS;
  };
  c.dc1394_capture_is_frame_corrupt = [](dc1394camera_t*, dc1394video_frame_t* frame) {
    return frame->id == shim().corrupt ? DC1394_TRUE : DC1394_FALSE;
  };
  return c;
}

/// The driver over the shim.
struct Rig {
  VirtualClock clock{5'000'000'000};
  Shim camera;
  Dc1394Calls functions = calls();
  v4l2::V4l2CameraSettings settings;
  std::optional<v4l2::V4l2Camera> driver;
  std::optional<test::GuardedImage> left, right;
  StereoFrame frame;

  explicit Rig(FrameFormat format = FrameFormat::y16, const IidcSettings& bus = {})
      : settings(v4l2::settings_of(format)) {
    settings.path = "the FireWire camera";
    settings.layout.left = 1, settings.layout.right = 0;
    driver.emplace(
        "camera", settings,
        std::make_unique<IidcVideoDevice>(bus, &functions, clock, [this] { return clock.now_ns() + kRealOffset_ns; }),
        clock);
    left.emplace(v4l2::format_of(settings));
    right.emplace(*left);
  }
  void start() {
    REQUIRE(driver->open());
    REQUIRE(driver->start(clock.now_ns()));
  }
  void arrives(uint32_t k) { camera.arrives(k, clock.now_ns()); }
  ReadStatus read() {
    frame = driver->read(left->view(), right->view(), clock.now_ns());
    return frame.status;
  }
};

}  // namespace

TEST_CASE("iidc: a Bumblebee2 in format 7, mode 3: the packets give the rate, the bytes of a pixel the eyes") {
  Rig rig;
  rig.start();
  CHECK(rig.camera.guid == kGuid);
  for (const char* call : {"speed 400", "mode 3", "roi", "trigger off", "capture", "send"})
    CHECK_MESSAGE(rig.camera.was_asked(call), call);
  CHECK_FALSE(rig.camera.was_asked("1394b"));
  // 192 bytes in at most 533 packets, in steps of 4 bytes: 48 packets of 4.
  CHECK(rig.camera.packet == 4);
  CHECK(rig.driver->format().rate_hz == doctest::Approx(1 / (48 * 125e-6)));
  rig.clock.advance_to(rig.clock.now_ns() + 100'000'000);
  rig.arrives(3);
  REQUIRE(rig.read() == ReadStatus::ok);
  CHECK(rig.frame.stamp_ns == rig.clock.now_ns() - 48 * 125'000);  // the end of the exposure
  CHECK(rig.frame.frame_number == 0);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 16; ++x) {
      const int at = 2 * (y * 16 + x);
      CHECK(rig.right->view().at(x, y) == static_cast<uint8_t>(at * 7 + 3 * 13));
      CHECK(rig.left->view().at(x, y) == static_cast<uint8_t>((at + 1) * 7 + 3 * 13));
    }
  CHECK(rig.camera.in_hand == 0);
  CHECK(rig.camera.ring.empty());
  CHECK(rig.read() == ReadStatus::no_data);
  rig.driver->close();
  CHECK(rig.camera.captures == 0);
  CHECK(rig.camera.open == 0);
  CHECK_FALSE(rig.camera.sends);
}

TEST_CASE("iidc: of several frames the newest is delivered, gaps are counted by the stamps") {
  Rig rig;
  rig.start();
  const int64_t period_ns = 48 * 125'000, begin_ns = rig.clock.now_ns() + 10 * period_ns;
  const auto at = [&](int k) { return begin_ns + k * period_ns; };
  for (const int k : {0, 1}) rig.camera.arrives(static_cast<uint32_t>(k), at(k));
  rig.clock.advance_to(at(1));
  REQUIRE(rig.read() == ReadStatus::ok);
  CHECK(rig.frame.frame_number == 1);
  CHECK(rig.driver->counters().skipped == 1);
  rig.clock.advance_to(at(5));
  rig.camera.arrives(5, at(5) + 300'000);  // 0.3 ms late: still the fifth
  REQUIRE(rig.read() == ReadStatus::ok);
  CHECK(rig.frame.frame_number == 5);
  CHECK(rig.driver->counters().missing == 3);
  CHECK(rig.driver->counters().frames == 2);
  // More than there are buffers wait in the ring, and none is lost to the caller.
  for (int k = 6; k < 16; ++k) rig.camera.arrives(static_cast<uint32_t>(k), at(k));
  rig.clock.advance_to(at(15));
  REQUIRE(rig.read() == ReadStatus::ok);
  CHECK(rig.frame.frame_number == 15);
  CHECK(rig.driver->counters().missing == 3);
}

TEST_CASE("iidc: three sensors, two of which are chosen, on a fast bus") {
  IidcSettings bus;
  bus.eyes = iidc::Eyes::narrow;
  bus.guid = 0x00b09d01009a8b7c;
  Rig rig(FrameFormat::rgb3, bus);
  rig.camera.codings = {DC1394_COLOR_CODING_MONO8, DC1394_COLOR_CODING_RGB8};
  rig.camera.bus_b = true;
  rig.start();
  CHECK(rig.camera.guid == bus.guid);
  for (const char* call : {"1394b", "speed 800", "pan 1"}) CHECK_MESSAGE(rig.camera.was_asked(call), call);
  rig.clock.advance_to(rig.clock.now_ns() + 100'000'000);
  rig.arrives(1);
  REQUIRE(rig.read() == ReadStatus::ok);
  CHECK(rig.right->view().at(1, 0) == static_cast<uint8_t>(3 * 7 + 13));
  CHECK(rig.left->view().at(1, 0) == static_cast<uint8_t>(4 * 7 + 13));
}

TEST_CASE("iidc: shutter, gain and trigger are set as asked for") {
  IidcSettings bus;
  bus.triggered = bus.falling = true;
  Rig rig(FrameFormat::y16, bus);
  rig.settings.exposure_s = 0.0123;
  rig.settings.gain = 300;
  rig.driver.emplace("camera", rig.settings, std::make_unique<IidcVideoDevice>(bus, &rig.functions, rig.clock),
                     rig.clock);
  REQUIRE(rig.driver->open());
  for (const char* call : {"manual", "absolute", "shutter 12300", "gain 300", "trigger mode", "trigger source",
                           "edge falling", "trigger on"})
    CHECK_MESSAGE(rig.camera.was_asked(call), call);
  CHECK(rig.camera.triggered);
}

TEST_CASE("iidc: a rate that the bus cannot give becomes the highest that it can") {
  Rig rig;
  rig.camera.most = 8;
  rig.settings.rate = Rate{2000, 1};
  rig.driver.emplace("camera", rig.settings,
                     std::make_unique<IidcVideoDevice>(IidcSettings{}, &rig.functions, rig.clock), rig.clock);
  REQUIRE(rig.driver->open());
  CHECK(rig.camera.packet == 8);
  CHECK(rig.driver->format().rate_hz == doctest::Approx(1 / (24 * 125e-6)));
}

TEST_CASE("iidc: a damaged frame is told, a camera that goes is lost, and found again by a restart") {
  Rig rig;
  rig.start();
  rig.clock.advance_to(rig.clock.now_ns() + 100'000'000);
  rig.camera.corrupt = 1;
  rig.arrives(1);
  CHECK(rig.read() == ReadStatus::partial);
  rig.camera.refuses["dequeue"] = DC1394_CAPTURE_IS_NOT_SET;
  CHECK(rig.read() == ReadStatus::disconnected);
  rig.camera.there = false;
  CHECK_FALSE(rig.driver->restart(rig.clock.now_ns()));
  CHECK(rig.camera.open == 0);
  rig.camera.there = true;
  rig.camera.refuses.clear();
  CHECK(rig.driver->restart(rig.clock.now_ns()));
  CHECK((rig.driver->declared_calls().calls & bit(JobCall::malloc)) != 0);  // a job did that
  rig.clock.advance_to(rig.clock.now_ns() + 100'000'000);
  rig.arrives(2);
  CHECK(rig.read() == ReadStatus::ok);
}

TEST_CASE("iidc: what keeps it from opening is said with its cure, and leaves nothing open") {
  const auto refusal = [](const std::function<void(Rig&)>& change, const IidcSettings& bus = {}) {
    Rig rig(FrameFormat::y16, bus);
    change(rig);
    const auto opened = rig.driver->open();
    REQUIRE_FALSE(opened);
    CHECK(rig.camera.open == 0);
    CHECK(rig.camera.captures == 0);
    return opened.error().what + " / " + opened.error().fix;
  };
  const auto has = [](const std::string& text, const char* part) {
    CHECK_MESSAGE(text.find(part) != std::string::npos, text);
  };
  has(refusal([](Rig& rig) { rig.camera.cameras = 0; }), "plug the camera in");
  has(refusal([](Rig& rig) { rig.camera.cameras = 2; }), "say with `guid`");
  has(refusal([](Rig& rig) { rig.camera.there = false; }, {.guid = 5, .eyes = {}}), "plug the camera in");
  has(refusal([](Rig& rig) { rig.camera.width = 32; }), "does not have the size of the rig");
  has(refusal([](Rig& rig) { rig.camera.codings = {DC1394_COLOR_CODING_RGB8}; }), "it offers: RGB3");
  has(refusal([](Rig& rig) { rig.camera.refuses["speed"] = DC1394_NO_BANDWIDTH; }), "the bus is full");
  has(refusal([](Rig& rig) { rig.camera.refuses["packet"] = DC1394_INVALID_VIDEO_FORMAT; }), "gives no buffers");
  has(refusal([](Rig& rig) {
        rig.driver.emplace("camera", rig.settings,
                           std::make_unique<IidcVideoDevice>(IidcSettings{}, nullptr, rig.clock), rig.clock);
      }),
      "apt install libdc1394-25");
  // Every refusal of the start, too.
  Rig rig;
  REQUIRE(rig.driver->open());
  rig.camera.refuses["send"] = DC1394_IOCTL_FAILURE;
  CHECK_FALSE(rig.driver->start(rig.clock.now_ns()));
  CHECK(rig.camera.captures == 0);
}
