// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: the conformance suites on drivers of the kernel, in real time. What the kernel has no
// hardware for is fed by the doubles, through the kernel: sockets of vcan and of two cards on one bus, frames written
// to v4l2loopback, lines pulled through gpio-sim.
#include "tests/conformance/devices.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/tty.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "hal/base/base_double.hpp"
#include "hal/base/can_base.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "hal/head/can_head.hpp"
#include "hal/head/head_double.hpp"
#include "tests/hil/guest.hpp"

using namespace takt;
using test::from_environment;
using test::kMs;
using test::level_of;
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
  test::check_camera_head(bus.driver, bus.pace_and_wait(host, head::messages()[head::kPosStatus]),
                          test::Ages::stretched);
  CHECK(bus.driver.station().counters().damaged == 0);
  CHECK(bus.driver.station().counters().foreign == 0);  // the kernel's filter lets nothing else through
}

void check_base_on(const char* host, const char* device) {
  BaseBus bus(host, device);
  test::check_mobile_base(bus.driver, true, bus.pace_and_wait(host, base::messages()[base::kWheels]),
                          test::Ages::stretched);
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

TEST_CASE("hil: digital_lines on gpio-sim") {
  const std::string chip = from_environment("HIL_GPIO_CHIP"), lines = from_environment("HIL_GPIO_LINES");
  const auto pull = [&](bool up) {
    std::ofstream(lines + "/sim_gpio1/pull") << (up ? "pull-up" : "pull-down");
    sleep_until(MonotonicClock().now_ns() + 100 * kMs);  // the simulated interrupt's work
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
  CHECK(level_of("sim_gpio2") == "1");
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
  CHECK(level_of("sim_gpio2") == "0");
}
