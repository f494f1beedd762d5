// SPDX-License-Identifier: Apache-2.0
// Devices that fail on time: each stands before another device of its interface and spoils what that one reads.
#pragma once
#include <memory>
#include <utility>

#include "hal/actor/actor.hpp"
#include "hal/base/mobile_base.hpp"
#include "hal/camera/stereo_camera.hpp"
#include "hal/gpio/digital_lines.hpp"
#include "hal/head/camera_head.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/object_sensor/object_sensor.hpp"
#include "hal/settings/failures.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/time/clock.hpp"

namespace takt::sim {

/// What all of them share. The inner device is started once and goes on through every failure, so that the simulated
/// world stays as it would be; while it is unplugged it gets no commands.
template <class Interface>
class FailingDevice : public Interface {
 public:
  FailingDevice(std::unique_ptr<Interface> inner, FailureSchedule schedule)
      : inner_(std::move(inner)), schedule_(std::move(schedule)) {}
  DeviceResult open() override { return inner_->open(); }
  void close() override { inner_->close(); }
  DeclaredCalls declared_calls() const override { return inner_->declared_calls(); }
  StampLaw stamp_law(const JobTimes& jobs) const override { return inner_->stamp_law(jobs); }
  DeviceResult start(int64_t epoch_ns) override {
    schedule_.begin(epoch_ns);
    plugged_ = true;
    const DeviceResult result = inner_->start(epoch_ns);
    started_ = result.has_value();
    return result;
  }
  void stop() override { inner_->stop(); }
  FaultSwitch* faults() override { return &schedule_.by_hand(); }
  bool restart(int64_t now_ns) override {
    plugged_ = schedule_.at(now_ns) != Misbehaviour::unplugged;
    return plugged_ && (started_ || start(now_ns).has_value());
  }

 protected:
  Interface& inner() { return *inner_; }
  const Interface& inner() const { return *inner_; }
  std::optional<Misbehaviour> failure_at(int64_t now_ns) {
    const auto failure = schedule_.at(now_ns);
    if (failure == Misbehaviour::unplugged) plugged_ = false;
    if (failure != Misbehaviour::frozen) kept_ = false;
    return plugged_ ? failure : Misbehaviour::unplugged;
  }
  bool plugged(int64_t now_ns) { return failure_at(now_ns) != Misbehaviour::unplugged; }
  /// What a read says that brings nothing.
  static std::optional<ReadStatus> nothing(std::optional<Misbehaviour> failure) {
    if (failure == Misbehaviour::silent) return ReadStatus::no_data;
    if (failure == Misbehaviour::unplugged) return ReadStatus::disconnected;
    return std::nullopt;
  }
  /// A reading without data of its own beside it: kept and given again, or marked as damaged.
  template <class Reading>
  void spoil(Reading& reading, Reading& kept, std::optional<Misbehaviour> failure) {
    if (reading.status != ReadStatus::ok || !failure) return;
    if (*failure == Misbehaviour::garbage) reading.status = ReadStatus::partial;
    if (*failure != Misbehaviour::frozen) return;
    const int64_t stamp_ns = reading.stamp_ns;
    if (!std::exchange(kept_, true)) kept = reading;
    reading = kept;
    reading.stamp_ns = stamp_ns;
  }
  bool kept_ = false;  ///< the data of a frozen device are kept

 private:
  std::unique_ptr<Interface> inner_;
  FailureSchedule schedule_;
  bool plugged_ = true, started_ = false;
};

class FailingCamera final : public FailingDevice<StereoCamera> {
 public:
  FailingCamera(std::unique_ptr<StereoCamera> inner, FailureSchedule schedule, const Clock& clock)
      : FailingDevice(std::move(inner), std::move(schedule)), clock_(clock) {}
  DeviceResult open() override;
  StereoFormat format() const override { return inner().format(); }
  void trigger(int64_t at_ns) override;
  StereoFrame read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) override;

 private:
  const Clock& clock_;
  std::optional<int64_t> triggered_ns_;
  std::vector<uint8_t> kept_left_, kept_right_;
};

class FailingLaser final : public FailingDevice<LaserScanner> {
 public:
  using FailingDevice::FailingDevice;
  DeviceResult open() override;
  ScanFormat format() const override { return inner().format(); }
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  std::vector<float> kept_range_m_;
};

class FailingHead final : public FailingDevice<CameraHead> {
 public:
  using FailingDevice::FailingDevice;
  HeadLimits limits() const override { return inner().limits(); }
  HeadReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  bool command(double pan_rad, double tilt_rad, int64_t at_ns) override {
    return plugged(at_ns) && inner().command(pan_rad, tilt_rad, at_ns);
  }
  void close_lids(bool left, bool right, int64_t at_ns) override {
    if (plugged(at_ns)) inner().close_lids(left, right, at_ns);
  }

 private:
  HeadReading kept_reading_;
};

class FailingBase final : public FailingDevice<MobileBase> {
 public:
  using FailingDevice::FailingDevice;
  BaseLimits limits() const override { return inner().limits(); }
  BaseReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  bool command(double speed_m_s, double turn_rad_s, int64_t at_ns) override {
    return plugged(at_ns) && inner().command(speed_m_s, turn_rad_s, at_ns);
  }

 private:
  BaseReading kept_reading_;
};

class FailingLines final : public FailingDevice<DigitalLines> {
 public:
  using FailingDevice::FailingDevice;
  uint32_t count() const override { return inner().count(); }
  LinesReading read(int64_t wanted_ns) override;
  bool write(uint32_t line, bool level, int64_t at_ns) override {
    return plugged(at_ns) && inner().write(line, level, at_ns);
  }

 private:
  LinesReading kept_reading_;
};

class FailingObjectSensor final : public FailingDevice<ObjectSensor> {
 public:
  using FailingDevice::FailingDevice;
  DeviceResult open() override;
  uint32_t most_objects() const override { return inner().most_objects(); }
  ObjectReading read(ObjectReports& reports, int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  std::vector<ObjectName> kept_names_;
  std::vector<ObjectPlace> kept_places_;
  std::vector<ObjectAttribute> kept_attributes_;
};

class FailingActor final : public FailingDevice<Actor> {
 public:
  using FailingDevice::FailingDevice;
  bool command(const ActionCommand& command, int64_t at_ns) override {
    return plugged(at_ns) && inner().command(command, at_ns);
  }
  ActorReading read(int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  ActorReading kept_reading_;
};

}  // namespace takt::sim
