// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: the conformance suites on drivers of the kernel, in real time. What the kernel has no
// hardware for is fed by the doubles, through the kernel: sockets of vcan and of two cards on one bus, frames written
// to v4l2loopback, lines pulled through gpio-sim.
#include "tests/conformance/devices.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/tty.h>
#include <linux/videodev2.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <thread>

#include "hal/base/base_double.hpp"
#include "hal/base/can_base.hpp"
#include "hal/camera/loopback_double.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "hal/head/can_head.hpp"
#include "hal/head/head_double.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/hil/guest.hpp"

using namespace takt;
using test::kMs;
using test::shell;
using test::sleep_until;

namespace {

/// Real time in steps: it stands while something is done, however long that takes. Emulation on a busy host stretches
/// time, and what a suite says of 20 ms must hold all the same.
class SteppedClock final : public Clock {
 public:
  int64_t now_ns() const override { return at_ns_; }
  bool is_virtual() const override { return false; }
  void go_to(int64_t at_ns) {
    sleep_until(stepped_ns_ + at_ns - at_ns_);
    stepped_ns_ = real_.now_ns();
    at_ns_ = at_ns;
  }

 private:
  MonotonicClock real_;
  int64_t at_ns_ = test::kDeviceEpoch, stepped_ns_ = real_.now_ns();
};

class RunningClock final : public Clock {
 public:
  int64_t now_ns() const override { return real_.now_ns(); }
  bool is_virtual() const override { return false; }
  void go_to(int64_t at_ns) { sleep_until(at_ns); }

 private:
  MonotonicClock real_;
};

/// A driver and its double, each on its interface. The double lives first, then time passes: what it sends is there.
template <class Driver, class Double, class BusClock = SteppedClock>
struct Bus {
  BusClock clock;
  Double device;
  Driver driver;
  std::optional<can::Port> listener;
  Bus(const char* host, const char* device_interface)
      : device(device_interface, clock), driver("device", {.interface = host}, clock) {
    REQUIRE(device.plug_in().has_value());
  }
  void pace(int64_t at_ns) {
    device.run_to(at_ns);
    clock.go_to(at_ns);
  }
  /// As pace, and the message that the device sends in each of its steps has arrived: from card to card that takes the
  /// emulation a while.
  test::Pace pace_and_wait(const char* host, const can::Message& message) {
    const std::array ids{message.id};
    REQUIRE(listener.emplace(host, clock).open(ids) == 0);
    return [this](int64_t at_ns) {
      int64_t expected = (at_ns - clock.now_ns()) / Double::kStep_ns;
      pace(at_ns);
      for (int ms = 0; ms < 1000 && expected > 0; ++ms) {
        while (listener->receive().status == can::PortStatus::ok) --expected;
        if (expected > 0) sleep_until(MonotonicClock().now_ns() + kMs);
      }
    };
  }
  /// Reads of 20 ms until one says that, at most so many.
  int reads_until(ReadStatus status, int most, bool restarts = true) {
    for (int k = 0; k < most; ++k) {
      pace(clock.now_ns() + test::kDevicePeriod);
      const ReadStatus said = driver.read(clock.now_ns(), INT64_MAX).status;
      if (said == status) return k;
      if (said == ReadStatus::disconnected && restarts) driver.restart(clock.now_ns());
    }
    return -1;
  }
};
using HeadBus = Bus<head::CanHead, head::HeadDouble>;
using BaseBus = Bus<base::CanBase, base::BaseDouble>;

void check_head_on(const char* host, const char* device) {
  HeadBus bus(host, device);
  test::check_camera_head(bus.driver, bus.pace_and_wait(host, head::messages()[head::kPosStatus]));
  CHECK(bus.driver.station().counters().damaged == 0);
  CHECK(bus.driver.station().counters().foreign == 0);  // the kernel's filter lets nothing else through
}

void check_base_on(const char* host, const char* device) {
  BaseBus bus(host, device);
  test::check_mobile_base(bus.driver, true, bus.pace_and_wait(host, base::messages()[base::kWheels]));
  CHECK(bus.driver.station().counters().damaged == 0);
}

}  // namespace

TEST_CASE("hil: camera_head on vcan") { check_head_on("vcan0", "vcan0"); }
TEST_CASE("hil: camera_head on two kvaser_pci of one bus") { check_head_on("can0", "can1"); }
TEST_CASE("hil: mobile_base on vcan") { check_base_on("vcan0", "vcan0"); }
TEST_CASE("hil: mobile_base on two kvaser_pci of one bus") { check_base_on("can0", "can1"); }

TEST_CASE("hil: vcan, the kernel's stamps of frames lie between their sending and their reading") {
  Bus<head::CanHead, head::HeadDouble, RunningClock> bus("vcan0", "vcan0");
  REQUIRE(bus.driver.open().has_value());
  REQUIRE(bus.driver.start(bus.clock.now_ns()).has_value());
  REQUIRE(bus.reads_until(ReadStatus::ok, 100) >= 0);
  int seen = 0;
  for (int k = 0; k < 100 && seen < 20; ++k) {
    bus.driver.read(bus.clock.now_ns(), INT64_MAX);
    const int64_t before_ns = bus.clock.now_ns();
    bus.device.run_to(before_ns + head::HeadDouble::kStep_ns);
    const int64_t sent_ns = bus.clock.now_ns();
    bus.clock.go_to(sent_ns + 20 * kMs);
    const HeadReading reading = bus.driver.read(bus.clock.now_ns(), INT64_MAX);
    if (reading.status != ReadStatus::ok) continue;  // held up for longer than a status is news
    CHECK(reading.stamp_ns >= before_ns - kMs);
    CHECK(reading.stamp_ns <= sent_ns + kMs);
    ++seen;
  }
  CHECK(seen > 0);
}

TEST_CASE("hil: vcan, an interface that goes down, is bus-off, is deleted: losses that end") {
  HeadBus bus("vcan0", "vcan0");
  REQUIRE(bus.driver.open().has_value());
  REQUIRE(bus.driver.start(bus.clock.now_ns()).has_value());
  REQUIRE(bus.reads_until(ReadStatus::ok, 100) >= 0);
  shell("ip link set vcan0 down");
  CHECK(bus.reads_until(ReadStatus::disconnected, 5, false) >= 0);
  shell("ip link set vcan0 up");
  CHECK(bus.reads_until(ReadStatus::ok, 200) >= 0);
  bus.device.misbehave(Misbehaviour::bus_off);
  CHECK(bus.reads_until(ReadStatus::disconnected, 5, false) >= 0);
  bus.device.misbehave(Misbehaviour::none);
  CHECK(bus.reads_until(ReadStatus::ok, 200) >= 0);
  shell("ip link delete vcan0");
  CHECK(bus.reads_until(ReadStatus::disconnected, 5, false) >= 0);
  CHECK_FALSE(bus.driver.restart(bus.clock.now_ns()));
  shell("ip link add vcan0 type vcan && ip link set vcan0 up");
  REQUIRE(bus.device.plug_in().has_value());
  CHECK(bus.reads_until(ReadStatus::ok, 200) >= 0);
}

TEST_CASE("hil: kvaser_pci, pulled out of its slot and put back") {
  HeadBus bus("can0", "can1");
  REQUIRE(bus.driver.open().has_value());
  REQUIRE(bus.driver.start(bus.clock.now_ns()).has_value());
  REQUIRE(bus.reads_until(ReadStatus::ok, 200) >= 0);
  shell("echo 1 > $(readlink -f /sys/class/net/can0/device)/remove");
  CHECK(bus.reads_until(ReadStatus::disconnected, 5, false) >= 0);
  CHECK_FALSE(bus.driver.restart(bus.clock.now_ns()));
  shell("echo 1 > /sys/bus/pci/rescan && " TAKT_SOURCE_DIR "/tests/hil/can_up can0");
  CHECK(bus.reads_until(ReadStatus::ok, 300) >= 0);
}

namespace {

/// A serial CAN adapter on a pseudo terminal: the far end of the kernel's slcan driver, whose controller it speaks for.
class SerialAdapter {
 public:
  SerialAdapter() : far_(posix_openpt(O_RDWR | O_NOCTTY)) {
    REQUIRE(grantpt(far_) == 0);
    REQUIRE(unlockpt(far_) == 0);
    near_ = ::open(ptsname(far_), O_RDWR | O_NOCTTY);
    REQUIRE(near_ >= 0);
    // The kernel waits until somebody has taken what it says.
    listener_ = std::thread([this] {
      std::array<char, 64> said;
      while (::read(far_, said.data(), said.size()) > 0) {
      }
    });
    termios raw{};
    cfmakeraw(&raw);
    REQUIRE(tcsetattr(near_, TCSANOW, &raw) == 0);
    int discipline = N_SLCAN;
    REQUIRE(ioctl(near_, TIOCSETD, &discipline) == 0);
    ifreq request{};
    REQUIRE(ioctl(near_, SIOCGIFNAME, &request) == 0);
    interface_ = request.ifr_name;
    shell("ip link set " + interface_ + " type can bitrate 500000");
    shell("ip link set " + interface_ + " up");
  }
  ~SerialAdapter() {
    ::close(near_);  // ends the listener's read
    listener_.join();
    ::close(far_);
  }
  const std::string& interface() const { return interface_; }
  void say(const std::string& line) {
    REQUIRE(::write(far_, (line + "\r").c_str(), line.size() + 1) == static_cast<ssize_t>(line.size() + 1));
    sleep_until(MonotonicClock().now_ns() + 200 * kMs);  // the line discipline works behind the write
  }

 private:
  int far_, near_ = -1;
  std::thread listener_;
  std::string interface_;
};

}  // namespace

TEST_CASE("hil: slcan, bus-off of a controller and its way back") {
  SerialAdapter adapter;
  SteppedClock clock;  // stands: no heartbeat falls due on the way, however slow the machine is
  head::CanHead driver("head", {.interface = adapter.interface()}, clock);
  REQUIRE(driver.open().has_value());
  REQUIRE(driver.start(clock.now_ns()).has_value());
  const auto status = [&] { return driver.read(clock.now_ns(), INT64_MAX).status; };
  const auto accepted = [&] { return driver.station().counters().accepted; };
  adapter.say("t710105");  // a heartbeat
  CHECK(status() == ReadStatus::no_data);
  CHECK(accepted() == 1);
  adapter.say("sp010130");
  CHECK(status() == ReadStatus::no_data);
  CHECK(driver.station().bus().state == can::BusState::passive);
  adapter.say("sb010255");
  CHECK(status() == ReadStatus::disconnected);
  CHECK(driver.station().link() == can::Link::bus_off);
  CHECK_FALSE(driver.restart(clock.now_ns()));
  // This controller is restarted by hand, as its driver demands.
  shell("ip link set " + adapter.interface() + " down");
  CHECK_FALSE(driver.restart(clock.now_ns()));
  shell("ip link set " + adapter.interface() + " up");
  CHECK(driver.restart(clock.now_ns()));
  adapter.say("t710105");
  CHECK(status() == ReadStatus::no_data);
  CHECK(accepted() == 2);
}

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

}  // namespace

TEST_CASE("hil: stereo_camera on v4l2loopback, bit by bit") {
  constexpr const char* kPath = "/dev/video0";
  MonotonicClock clock;
  const auto settings = camera_settings(kPath, v4l2::FrameFormat::y16);
  v4l2::LoopbackDouble::Settings fed{kPath, settings.layout, settings.rate};
  fed.layout.width = settings.rig.width;
  fed.layout.height = settings.rig.height;
  uint32_t fed_number = 0;
  v4l2::LoopbackDouble feeder(fed, [&](uint32_t number, int64_t, std::span<uint8_t> frame) {
    fed_number = number;
    for (size_t i = 0; i < frame.size(); ++i) frame[i] = byte_of_frame(number, i);
  });
  REQUIRE(feeder.plug_in().has_value());
  feeder.run_to(clock.now_ns());  // there is nothing to be opened before
  v4l2::V4l2Camera camera("camera", settings, std::make_unique<v4l2::KernelVideoDevice>(), clock);
  const auto pace = [&](int64_t at_ns) {
    feeder.run_to(at_ns);
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

TEST_CASE("hil: digital_lines on gpio-sim") {
  const char* chip = std::getenv("HIL_GPIO_CHIP");
  const char* lines = std::getenv("HIL_GPIO_LINES");
  REQUIRE(chip != nullptr);
  REQUIRE(lines != nullptr);
  const auto pull = [&](bool up) {
    std::ofstream(std::string(lines) + "/sim_gpio1/pull") << (up ? "pull-up" : "pull-down");
    sleep_until(MonotonicClock().now_ns() + 100 * kMs);  // the simulated interrupt's work
  };
  const auto power = [&] {
    std::string value;
    std::ifstream(std::string(lines) + "/sim_gpio2/value") >> value;
    return value;
  };
  MonotonicClock clock;
  pull(true);
  gpio::GpioLines device("lines",
                         {.chip = chip, .inputs = {"estop"}, .powered = {"eyelid_power"}, .debounce_ns = 5 * kMs},
                         std::make_unique<gpio::KernelLineChip>(), clock);
  test::check_digital_lines(device, 0, [&](uint32_t, bool level) { pull(level); });

  pull(true);
  REQUIRE(device.open().has_value());
  REQUIRE(device.start(clock.now_ns()).has_value());
  CHECK(power() == "1");
  device.read(clock.now_ns());
  const int64_t before_ns = clock.now_ns();
  pull(false);
  const LinesReading pressed = device.read(clock.now_ns());
  CHECK(pressed.changed == 1);
  CHECK((pressed.levels & 1) == 0);
  CHECK(pressed.edge_ns >= before_ns);  // the kernel's stamp is on the clock of the runtime
  CHECK(pressed.edge_ns <= clock.now_ns() - 50 * kMs);
  gpio::GpioLines second("second", {.chip = chip, .inputs = {"estop"}}, std::make_unique<gpio::KernelLineChip>(),
                         clock);
  const auto opened = second.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().text().find("gpioinfo names it") != std::string::npos);
  device.stop();
  CHECK(power() == "0");
}
