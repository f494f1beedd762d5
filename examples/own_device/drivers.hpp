// SPDX-License-Identifier: Apache-2.0
// Two drivers of the interface: a file of the kernel, and a simulated thermometer that stands in for it.
#pragma once
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <takt/hal/settings/failures.hpp>

#include "thermometer.hpp"

/// A sensor of the kernel, such as /sys/class/thermal/thermal_zone0/temp: thousandths of a degree, as text.
class SysfsThermometer final : public Thermometer {
 public:
  SysfsThermometer(std::string id, std::string path) : id_(std::move(id)), path_(std::move(path)) {}
  ~SysfsThermometer() override { close_file(); }

  takt::DeviceResult open() override {
    if (file_ < 0) file_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    if (file_ >= 0) return {};
    return takt::device_failure(id_, path_ + " cannot be opened", "ls /sys/class/thermal/*/temp shows those there are");
  }
  void close() override { close_file(); }
  takt::DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
  Reading read(int64_t now_ns) override {
    char text[16] = {};
    if (pread(file_, text, sizeof text - 1, 0) <= 0) return {takt::ReadStatus::disconnected, 0, now_ns};
    return {takt::ReadStatus::ok, static_cast<double>(std::atoi(text)) / 1000.0, now_ns};
  }
  takt::DeclaredCalls declared_calls() const override {
    return {takt::bit(takt::JobCall::file), "one read of a file of the kernel, which does not wait"};
  }

 private:
  void close_file() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }
  std::string id_, path_;
  int file_ = -1;
};

/// The simulated double: a room that gets warmer by `slope` degrees a second. The same data in each run. It can be
/// silent: `takt fault wall silent on`.
class SimulatedThermometer final : public Thermometer {
 public:
  explicit SimulatedThermometer(double slope) : slope_(slope) {}
  takt::DeviceResult open() override { return {}; }
  void close() override {}
  takt::DeviceResult start(int64_t epoch_ns) override {
    epoch_ns_ = epoch_ns;
    return {};
  }
  void stop() override {}
  takt::FaultSwitch* faults() override { return &failures_.by_hand(); }
  Reading read(int64_t now_ns) override {
    if (failures_.at(now_ns)) return {takt::ReadStatus::no_data, 0, now_ns};
    return {takt::ReadStatus::ok, 20 + slope_ * static_cast<double>(now_ns - epoch_ns_) * 1e-9, now_ns};
  }

 private:
  double slope_;
  takt::FailureSchedule failures_{{}, std::array{takt::Misbehaviour::silent}};
  int64_t epoch_ns_ = 0;
};
