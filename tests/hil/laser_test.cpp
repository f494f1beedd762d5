// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: the LMS 200 behind a USB adapter of the kernel (ftdi_sio). Its double is a process of
// the machine outside, at the terminal that QEMU's adapter is connected to; that one hands on the rate that is set, so
// that a wrong one garbles.
#include "hal/laser/lms200/session.hpp"
#include "hal/laser/stream_laser.hpp"
#include "hal/stream/serial_port.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/hil/guest.hpp"

using namespace takt;
using namespace takt::test;

namespace {

constexpr const char* kPort = "/dev/ttyUSB0";

/// Real time that begins where the suites begin.
class SuiteClock final : public Clock {
 public:
  int64_t now_ns() const override { return kDeviceEpoch + real_.now_ns() - begin_ns_; }
  bool is_virtual() const override { return false; }
  void go_to(int64_t at_ns) const { sleep_until(begin_ns_ + at_ns - kDeviceEpoch); }

 private:
  MonotonicClock real_;
  int64_t begin_ns_ = real_.now_ns();
};

/// The driver as a graph makes it.
struct Laser {
  lms200::Session* session = nullptr;  ///< its thread's while it runs
  std::unique_ptr<StreamLaser> driver;
  Laser(uint32_t baud, const Clock& clock) {
    lms200::SessionSettings settings;
    settings.baud = baud;
    auto talk = std::make_unique<lms200::Session>(settings);
    session = talk.get();
    driver = std::make_unique<StreamLaser>("laser", std::make_unique<SerialPort>("laser", kPort), std::move(talk),
                                           Transform{}, clock);
  }
};

}  // namespace

TEST_CASE("hil: laser_scanner lms200 at 38400 baud on usb-serial (ftdi_sio)") {
  const SuiteClock clock;
  Laser laser(38400, clock);
  // A sweep every 16 turns of the mirror (D-1.9). Each read waits for the one that follows the last.
  const auto advance_to = [&](int64_t to_ns) {
    clock.go_to(to_ns);
    const uint64_t before = laser.driver->counts().received;
    for (int ms = 0; ms < 2000 && laser.driver->counts().received == before; ++ms) sleep_for(kMs);
  };
  check_laser_scanner(*laser.driver, {kDeviceEpoch + 10'000 * kMs, 16 * lms200::kTurn_ns, advance_to});
  CHECK(laser.session->baud() == 38400);
  CHECK(laser.driver->counts().damaged == 0);
}
