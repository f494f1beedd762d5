// SPDX-License-Identifier: Apache-2.0
// Devices that fail on time: how it is written, and what each interface then gives.
#include "hal/settings/failures.hpp"

#include <doctest/doctest.h>

#include "hal/sim/failing_devices.hpp"
#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::kSecond;

namespace {

constexpr int64_t kFailureEpoch = 7 * kSecond;

FailureSchedule schedule(const char* text) {
  auto windows = parse_failures(text);
  REQUIRE(windows.has_value());
  return FailureSchedule(std::move(*windows));
}

/// The status of a read in the middle of each second, restarting what is disconnected before the next one.
template <class Interface, class Read>
std::vector<ReadStatus> each_second(Interface& device, Read&& read) {
  REQUIRE(device.open().has_value());
  REQUIRE(device.start(kFailureEpoch).has_value());
  std::vector<ReadStatus> statuses;
  for (int64_t s = 0; s < 6; ++s) {
    const int64_t at_ns = kFailureEpoch + s * kSecond + kSecond / 2;
    statuses.push_back(read(at_ns));
    if (statuses.back() == ReadStatus::disconnected) {
      CHECK_FALSE(device.restart(at_ns));
      CHECK(read(at_ns + 1) == ReadStatus::disconnected);
      CHECK(device.restart(at_ns + kSecond));
    }
  }
  return statuses;
}

constexpr const char* kAll = "silent 1s..2s, unplugged 2s..3s, garbage 3s..4s, frozen 4s..5000ms";
const std::vector<ReadStatus> kExpected{ReadStatus::ok,      ReadStatus::no_data, ReadStatus::disconnected,
                                        ReadStatus::partial, ReadStatus::ok,      ReadStatus::ok};

}  // namespace

TEST_CASE("failures are written with their windows; mistakes are told with the form") {
  const auto windows = parse_failures(" unplugged 2s..4s,frozen 6s .. 6.5s ");
  REQUIRE(windows.has_value());
  REQUIRE(windows->size() == 2);
  CHECK((*windows)[0].failure == Misbehaviour::unplugged);
  CHECK((*windows)[0].from_ns == 2 * kSecond);
  CHECK((*windows)[0].to_ns == 4 * kSecond);
  CHECK((*windows)[1].failure == Misbehaviour::frozen);
  CHECK((*windows)[1].to_ns == 6 * kSecond + kSecond / 2);
  CHECK(parse_failures("")->empty());
  for (const char* wrong : {"unpluged 2s..4s", "silent", "silent 2s", "silent 2..4s", "silent 4s..2s", "silent -1s..2s",
                            "silent 2s..4s frozen 6s..7s", "silent 1s..1s"}) {
    CAPTURE(wrong);
    const auto parsed = parse_failures(wrong);
    REQUIRE_FALSE(parsed);
    CHECK(parsed.error().find("unplugged 2s..4s, frozen 6s..6.5s") != std::string::npos);
  }
}

TEST_CASE("windows begin with the epoch and are half open") {
  FailureSchedule failures = schedule("silent 1s..2s");
  failures.begin(kFailureEpoch);
  CHECK_FALSE(failures.at(kFailureEpoch + kSecond - 1));
  CHECK(failures.at(kFailureEpoch + kSecond) == Misbehaviour::silent);
  CHECK(failures.at(kFailureEpoch + 2 * kSecond - 1) == Misbehaviour::silent);
  CHECK_FALSE(failures.at(kFailureEpoch + 2 * kSecond));
}

TEST_CASE("a laser, a head, a base and lines fail as they are told, and work before and after") {
  const auto world = test::small_simulation();
  FailingLaser laser(std::make_unique<SimLaser>("laser", LaserModel{}, *world), schedule(kAll));
  std::vector<float> ranges;
  CHECK(each_second(laser, [&](int64_t at_ns) {
          ranges.resize(laser.format().beams);
          return laser.read(ranges, at_ns, INT64_MAX).status;
        }) == kExpected);
  FailingHead head(std::make_unique<SimHead>("head", *world), schedule(kAll));
  CHECK(each_second(head, [&](int64_t at_ns) { return head.read(at_ns, INT64_MAX).status; }) == kExpected);
  FailingBase base(std::make_unique<SimBase>("base", OdometryModel{}, *world), schedule(kAll));
  CHECK(each_second(base, [&](int64_t at_ns) { return base.read(at_ns, INT64_MAX).status; }) == kExpected);
  FailingLines lines(std::make_unique<SimLines>("lines", *world), schedule(kAll));
  CHECK(each_second(lines, [&](int64_t at_ns) { return lines.read(at_ns).status; }) == kExpected);
}

TEST_CASE("a frozen laser gives one scan with new stamps; of a damaged one half is missing") {
  const auto world = test::small_simulation();
  FailingLaser laser(std::make_unique<SimLaser>("laser", LaserModel{}, *world),
                     schedule("frozen 1s..2s, garbage 3s..4s"));
  REQUIRE(laser.open().has_value());
  REQUIRE(laser.start(kFailureEpoch).has_value());
  std::vector<float> first(laser.format().beams), second(first), fresh(first);
  const auto read = [&](std::vector<float>& ranges, int64_t after_ns) {
    return laser.read(ranges, kFailureEpoch + after_ns, INT64_MAX);
  };
  const int64_t stamp = read(first, kSecond).stamp_ns;
  CHECK(read(second, kSecond + kSecond / 2).stamp_ns > stamp);
  CHECK(first == second);
  CHECK(read(fresh, 2 * kSecond).status == ReadStatus::ok);
  CHECK(fresh != first);  // the sensor's noise
  CHECK(read(fresh, 3 * kSecond).status == ReadStatus::partial);
  CHECK(fresh.front() > 0);
  CHECK(fresh.back() == 0);
}

TEST_CASE("a frozen camera gives one pair with new stamps; unplugged it needs a restart") {
  const auto world = test::small_simulation();
  VirtualClock clock(kFailureEpoch);
  FailingCamera camera(
      std::make_unique<SimCamera>("camera", SimCameraSettings{test::small_rig(), {}, {15, 1}, false}, *world, clock),
      schedule(kAll), clock);
  std::vector<std::vector<uint8_t>> frozen;
  const auto read = [&](int64_t at_ns) {
    test::GuardedImage left(camera.format()), right(camera.format());
    camera.trigger(at_ns);
    const StereoFrame frame = camera.read(left.view(), right.view(), INT64_MAX);
    if (frame.status == ReadStatus::ok) CHECK(frame.stamp_ns == at_ns);
    frozen.push_back(left.bytes);
    return frame.status;
  };
  CHECK(each_second(camera, read) == kExpected);
  frozen.clear();
  read(kFailureEpoch + 4 * kSecond + 1), read(kFailureEpoch + 4 * kSecond + 2), read(kFailureEpoch + 5 * kSecond);
  CHECK(frozen[0] == frozen[1]);
  CHECK(frozen[1] != frozen[2]);
}

TEST_CASE("an unplugged base takes no command") {
  const auto world = test::small_simulation();
  FailingBase base(std::make_unique<SimBase>("base", OdometryModel{}, *world), schedule("unplugged 1s..2s"));
  REQUIRE(base.open().has_value());
  REQUIRE(base.start(kFailureEpoch).has_value());
  CHECK(base.command(0.2, 0, kFailureEpoch));
  CHECK_FALSE(base.command(0.2, 0, kFailureEpoch + kSecond));
  CHECK_FALSE(base.command(0.2, 0, kFailureEpoch + 3 * kSecond));  // not yet restarted
  CHECK(base.restart(kFailureEpoch + 3 * kSecond));
  CHECK(base.command(0.2, 0, kFailureEpoch + 3 * kSecond));
}

TEST_CASE("devices that do not fail conform, behind what would make them fail") {
  const auto world = test::small_simulation();
  FailingLaser laser(std::make_unique<SimLaser>("laser", LaserModel{}, *world), schedule("silent 900s..901s"));
  test::check_laser_scanner(laser);
}
