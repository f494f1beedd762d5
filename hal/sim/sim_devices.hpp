// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/base/mobile_base.hpp"
#include "hal/gpio/digital_lines.hpp"
#include "hal/head/camera_head.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/sim/sensors.hpp"
#include "rt/time/clock.hpp"

namespace takt::sim {

/// Laser scanner of the simulated world; the sweep ends at the wanted instant.
class SimLaser final : public LaserScanner {
 public:
  SimLaser(std::string id, LaserModel model, Simulation& simulation)
      : id_(std::move(id)), model_(model), simulation_(simulation) {}
  DeviceResult open() override;
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  ScanFormat format() const override;
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  std::string id_;
  LaserModel model_;
  Simulation& simulation_;
  Snapshot met_;
  bool started_ = false;
  uint32_t scans_ = 0;
};

/// Pan-tilt head of the simulated world: speed- and acceleration-limited, acts 100 ms after the command.
class SimHead final : public CameraHead {
 public:
  SimHead(std::string id, Simulation& simulation) : id_(std::move(id)), simulation_(simulation) {}
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  HeadLimits limits() const override { return simulation_.head_limits(); }
  HeadReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  bool command(double pan_rad, double tilt_rad, int64_t at_ns) override;

 private:
  std::string id_;
  Simulation& simulation_;
  bool started_ = false;
};

/// Base of the simulated world: drives the world's path, or obeys commands if it has none (or drive: command).
class SimBase final : public MobileBase {
 public:
  /// With a clock it lives through what is past in start(), not in the first read() after it.
  SimBase(std::string id, OdometryModel model, Simulation& simulation, const Clock* clock = nullptr);
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  BaseLimits limits() const override { return {1.4, 1.35, 1.2}; }
  BaseReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  /// Always false while the base drives a path: the command is ignored.
  bool command(double speed_m_s, double turn_rad_s, int64_t at_ns) override;

 private:
  std::string id_;
  Simulation& simulation_;
  const Clock* clock_;
  DriftingOdometry odometry_;
  bool started_ = false;
};

/// Digital lines of the simulated world.
class SimLines final : public DigitalLines {
 public:
  SimLines(std::string id, Simulation& simulation) : id_(std::move(id)), simulation_(simulation) {}
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  uint32_t count() const override { return simulation_.line_count(); }
  LinesReading read(int64_t wanted_ns) override;
  bool write(uint32_t, bool, int64_t) override { return false; }  // the simulated lines are inputs

 private:
  std::string id_;
  Simulation& simulation_;
  bool started_ = false, first_ = true;
  int64_t previous_ns_ = 0;
  uint32_t previous_ = 0;
};

}  // namespace takt::sim
