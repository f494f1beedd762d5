// SPDX-License-Identifier: Apache-2.0
// What every LaserScanner, CameraHead, MobileBase, DigitalLines, ObjectSensor and Actor must do. Each function takes a
// fresh closed device.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "hal/actor/actor.hpp"
#include "hal/base/mobile_base.hpp"
#include "hal/gpio/digital_lines.hpp"
#include "hal/head/camera_head.hpp"
#include "hal/interaction/interaction.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/object_sensor/object_sensor.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/testing.hpp"

namespace takt::test {

constexpr int64_t kDeviceEpoch = 7'000'000'000;
constexpr int64_t kDevicePeriod = 20'000'000;

/// Lets the world behind a device go on until that instant: doubles live, virtual time passes, real time is waited for.
/// A simulated world needs none of it.
using Pace = std::function<void(int64_t at_ns)>;
inline void no_pace(int64_t) {}
/// Within so many periods a device that is well has found its zero, is enabled and follows its commands.
constexpr int kPeriodsToReady = 500;

/// When a scanner is read, and what moves its world there; by default one that always has a new sweep.
struct LaserPace {
  int64_t first_ns = kDeviceEpoch, period_ns = kDevicePeriod;
  Pace advance_to = no_pace;
};

/// A reading for a job that is released at `wanted_ns` is no older than the device has told in advance.
inline void check_age(const Device& device, int64_t stamp_ns, int64_t wanted_ns) {
  const StampLaw law = device.stamp_law({Rate{50, 1}, 0});  // kDevicePeriod
  REQUIRE(law.unknown == "");
  CHECK(stamp_ns <= wanted_ns);
  CHECK(wanted_ns - stamp_ns <= law.lag_ns());
}

inline void check_laser_scanner(LaserScanner& laser, const LaserPace& pace = {}) {
  REQUIRE(laser.open().has_value());
  const ScanFormat format = laser.format();
  REQUIRE(format.beams >= 2);
  CHECK(format.step_rad > 0);
  CHECK(format.max_range_m > 0);
  CHECK(format.sweep_s >= 0);
  std::vector<float> range(format.beams + 8, -7.0f);
  const std::span<float> beams(range.data(), format.beams);
  CHECK(laser.read(beams, kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);  // not started
  REQUIRE(laser.start(kDeviceEpoch).has_value());
  CHECK(laser.read(beams, kDeviceEpoch + 1, kDeviceEpoch).status == ReadStatus::no_data);
  CHECK(range[0] == -7.0f);
  int64_t previous = INT64_MIN;
  uint32_t first_number = 0;
  for (uint32_t k = 0; k < 5; ++k) {
    const int64_t wanted = pace.first_ns + k * pace.period_ns;
    pace.advance_to(wanted);
    const ScanReading reading = laser.read(beams, wanted, INT64_MAX);
    REQUIRE(reading.status == ReadStatus::ok);
    check_age(laser, reading.stamp_ns, wanted);
    CHECK(reading.stamp_ns > previous);
    if (k == 0) first_number = reading.scan_number;
    CHECK(reading.scan_number == first_number + k);
    previous = reading.stamp_ns;
    for (const float r : beams) CHECK((r == 0.0f || (r > 0.0f && static_cast<double>(r) < format.max_range_m + 0.1)));
  }
  for (size_t i = format.beams; i < range.size(); ++i) CHECK(range[i] == -7.0f);
  laser.stop();
  CHECK(laser.read(beams, kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);
  laser.close();
}

/// Where an emulated machine stretches the time between sending and arrival, ages say nothing.
enum class Ages : uint8_t { bounded, stretched };

inline void check_camera_head(CameraHead& head, const Pace& pace = no_pace, Ages ages = Ages::bounded) {
  REQUIRE(head.open().has_value());
  CHECK(head.read(kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);
  REQUIRE(head.start(kDeviceEpoch).has_value());
  int64_t at = kDeviceEpoch;
  const auto next = [&] {
    at += kDevicePeriod;
    pace(at);
  };
  bool follows = head.command(0.5, -0.2, at);
  for (int k = 0; k < kPeriodsToReady && !follows; ++k) {
    next();
    head.read(at, INT64_MAX);
    follows = head.command(0.5, -0.2, at);
  }
  REQUIRE(follows);
  const HeadLimits limits = head.limits();
  double fastest = 0, previous = head.read(at, INT64_MAX).pan_rad;
  HeadReading reading;
  for (int64_t k = 1; k <= 100; ++k) {
    next();
    head.command(0.5, -0.2, at);
    reading = head.read(at, INT64_MAX);
    REQUIRE(reading.status == ReadStatus::ok);
    if (ages == Ages::bounded) check_age(head, reading.stamp_ns, at);
    fastest = std::max(fastest, std::abs(reading.pan_rad - previous) / 0.02);
    previous = reading.pan_rad;
  }
  CHECK(reading.pan_rad == doctest::Approx(0.5).epsilon(0.01));
  CHECK(reading.tilt_rad == doctest::Approx(-0.2).epsilon(0.01));
  CHECK_FALSE(reading.moving);
  CHECK(fastest > 0.1);
  CHECK(fastest <= limits.pan_rad_s * 1.001);
  // Beyond the limits: clamped, and said so.
  next();
  CHECK_FALSE(head.command(limits.pan_rad + 1, 0, at));
  CHECK_FALSE(head.command(std::nan(""), 0, at));
  for (int64_t k = 102; k <= 400; ++k) {
    next();
    reading = head.read(at, INT64_MAX);
    CHECK(reading.pan_rad <= limits.pan_rad + 1e-6);
  }
  head.stop();
  CHECK(head.read(at + kDevicePeriod, INT64_MAX).status == ReadStatus::no_data);
  head.close();
}

/// Two tasks are given, 2 and 4 periods after the epoch.
inline void check_interaction(Interaction& person, const Pace& pace = no_pace) {
  CHECK(person.read(kDeviceEpoch).status == ReadStatus::no_data);
  REQUIRE(person.open().has_value());
  CHECK(person.read(kDeviceEpoch).status == ReadStatus::no_data);
  REQUIRE(person.start(kDeviceEpoch).has_value());
  for (int64_t k = 0; k < 8; ++k) {
    const int64_t at = kDeviceEpoch + k * kDevicePeriod;
    pace(at);
    const InteractionReading reading = person.read(at);
    REQUIRE(reading.status == ReadStatus::ok);  // also where nobody says anything
    check_age(person, reading.stamp_ns, at);
    CHECK(reading.number == (k < 2 ? 0 : k < 4 ? 1 : 2));
    CHECK(reading.task.empty() == (k < 2));
    CHECK(reading.task.size() <= Interaction::kLongestTask);
    CHECK(person.say("heard"));
  }
  person.stop();
  CHECK(person.read(kDeviceEpoch + 9 * kDevicePeriod).status == ReadStatus::no_data);
  person.close();
  REQUIRE(person.open().has_value());
  REQUIRE(person.start(kDeviceEpoch).has_value());
  person.close();
}

/// `obeys`: the base takes velocity commands (a simulated one may drive a path instead).
inline void check_mobile_base(MobileBase& base, bool obeys, const Pace& pace = no_pace, Ages ages = Ages::bounded) {
  REQUIRE(base.open().has_value());
  CHECK(base.read(kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);
  REQUIRE(base.start(kDeviceEpoch).has_value());
  const BaseLimits limits = base.limits();
  int64_t at = kDeviceEpoch;
  BaseReading before = base.read(at, INT64_MAX);
  const auto ready = [&] { return before.status == ReadStatus::ok && (!obeys || base.command(0, 0, at)); };
  for (int k = 0; k < kPeriodsToReady && !ready(); ++k) {
    at += kDevicePeriod;
    pace(at);
    before = base.read(at, INT64_MAX);
  }
  REQUIRE(before.status == ReadStatus::ok);
  const uint32_t epoch = before.epoch;
  const auto drive = [&](double speed, int jobs, bool repeat) {
    for (int k = 0; k < jobs; ++k) {
      at += kDevicePeriod;
      pace(at);
      if (repeat) CHECK(base.command(speed, 0.0, at) == obeys);
      const BaseReading now = base.read(at, INT64_MAX);
      REQUIRE(now.status == ReadStatus::ok);
      if (ages == Ages::bounded) check_age(base, now.stamp_ns, at);
      CHECK(now.epoch == epoch);
      CHECK(std::abs(now.speed_m_s) <= limits.speed_m_s * 1.02);
      CHECK(std::abs(now.speed_m_s - before.speed_m_s) <= limits.acceleration_m_s2 * 0.02 * 1.05 + 1e-9);
      CHECK(std::hypot(now.x_m - before.x_m, now.y_m - before.y_m) <= limits.speed_m_s * 0.02 * 1.05);
      before = now;
    }
  };
  drive(0.3, 75, true);
  CHECK(before.speed_m_s > 0.1);
  if (obeys) {
    drive(0.0, 60, false);  // nobody repeats the command: the watchdog stops the base
    CHECK(std::abs(before.speed_m_s) < 1e-6);
    CHECK_FALSE(base.command(limits.speed_m_s * 2, 0, at));
  }
  base.stop();
  CHECK(base.read(at, INT64_MAX).status == ReadStatus::no_data);
  base.close();
}

/// `set` changes a line from now on. Without a pace the instants of the reads are not those of the device's clock.
template <class Set>
void check_digital_lines(DigitalLines& lines, uint32_t line, Set set, const Pace& pace = {}) {
  REQUIRE(lines.open().has_value());
  REQUIRE(lines.count() > line);
  CHECK(lines.read(kDeviceEpoch).status == ReadStatus::no_data);
  REQUIRE(lines.start(kDeviceEpoch).has_value());
  const LinesReading first = lines.read(kDeviceEpoch);
  REQUIRE(first.status == ReadStatus::ok);
  CHECK(first.changed == 0);
  CHECK((first.levels >> lines.count()) == 0);
  set(line, (first.levels >> line & 1) == 0);
  if (pace) pace(kDeviceEpoch + kDevicePeriod);
  const LinesReading second = lines.read(kDeviceEpoch + kDevicePeriod);
  if (pace) check_age(lines, second.stamp_ns, kDeviceEpoch + kDevicePeriod);
  CHECK((second.levels ^ first.levels) == 1u << line);
  CHECK(second.changed == 1u << line);
  CHECK(lines.read(kDeviceEpoch + 2 * kDevicePeriod).changed == 0);
  lines.stop();
  CHECK(lines.read(kDeviceEpoch + 3 * kDevicePeriod).status == ReadStatus::no_data);
  lines.close();
}

/// Something is in view.
inline void check_object_sensor(ObjectSensor& sensor, const Pace& pace = no_pace) {
  REQUIRE(sensor.open().has_value());
  REQUIRE(sensor.most_objects() >= 1);
  Capacity capacity;
  capacity.count = sensor.most_objects();
  Box<ObjectReports> reports(capacity);
  CHECK(sensor.read(*reports, kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);
  REQUIRE(sensor.start(kDeviceEpoch).has_value());
  CHECK(sensor.read(*reports, kDeviceEpoch + 1, kDeviceEpoch).status == ReadStatus::no_data);
  int64_t previous = INT64_MIN;
  for (int64_t k = 0; k < 5; ++k) {
    const int64_t wanted = kDeviceEpoch + k * kDevicePeriod;
    pace(wanted);
    const ObjectReading reading = sensor.read(*reports, wanted, INT64_MAX);
    REQUIRE(reading.status == ReadStatus::ok);
    check_age(sensor, reading.stamp_ns, wanted);
    CHECK(reading.stamp_ns > previous);
    previous = reading.stamp_ns;
    CHECK(reports->in_map == 0);
    REQUIRE(reports->places.size > 0);
    CHECK(reports->names.size == reports->places.size);
    float attributes = 0;
    for (const ObjectPlace& place : reports->places.items()) {
      CHECK(std::isfinite(place.x_m + place.y_m + place.z_m + place.yaw_rad));
      CHECK((place.score >= 0 && place.score <= 1));
      attributes += place.attributes;
    }
    CHECK(attributes == static_cast<float>(reports->attributes.size));
    for (const ObjectName& name : reports->names.items()) {
      CHECK(name.type[0] != 0);
      CHECK(name.type[sizeof name.type - 1] == 0);
      CHECK(name.name[sizeof name.name - 1] == 0);
    }
  }
  sensor.stop();
  CHECK(sensor.read(*reports, previous + kDevicePeriod, INT64_MAX).status == ReadStatus::no_data);
  sensor.close();
}

/// `good` can be carried out within 500 periods, `bad` cannot; their numbers differ.
inline void check_actor(Actor& actor, const ActionCommand& good, const ActionCommand& bad, const Pace& pace = no_pace) {
  REQUIRE(actor.open().has_value());
  CHECK(actor.read(kDeviceEpoch, INT64_MAX).status == ReadStatus::no_data);
  REQUIRE(actor.start(kDeviceEpoch).has_value());
  CHECK(actor.read(kDeviceEpoch + 1, kDeviceEpoch).status == ReadStatus::no_data);
  CHECK(actor.read(kDeviceEpoch, INT64_MAX).outcome.state == action_state::none);
  int64_t at = kDeviceEpoch;
  // Repeats the command until it is over.
  const auto carry_out = [&](const ActionCommand& command) {
    ActionOutcome before;
    for (int k = 0; k < kPeriodsToReady; ++k) {
      at += kDevicePeriod;
      pace(at);
      actor.command(command, at);
      const ActorReading reading = actor.read(at, INT64_MAX);
      REQUIRE(reading.status == ReadStatus::ok);
      check_age(actor, reading.stamp_ns, at);
      CHECK(reading.outcome.number == command.number);
      CHECK(reading.outcome.duration_s >= before.duration_s);
      before = reading.outcome;
      if (before.state != action_state::under_way) break;
    }
    return before;
  };
  const ActionOutcome done = carry_out(good), refused = carry_out(bad);
  CHECK(done.state == action_state::done);
  CHECK(done.duration_s > 0);
  CHECK(done.reason[0] == 0);
  CHECK((refused.state == action_state::refused || refused.state == action_state::failed));
  CHECK(refused.reason[0] != 0);
  actor.stop();
  CHECK(actor.read(at + kDevicePeriod, INT64_MAX).status == ReadStatus::no_data);
  actor.close();
}

}  // namespace takt::test
