// SPDX-License-Identifier: Apache-2.0
// A device interface of its own: what every thermometer can do, and the node that feeds its data into a graph.
#pragma once
#include <cstdint>
#include <memory>
#include <takt/hal/device_node.hpp>
#include <takt/msg/field_list.hpp>

struct Temperature {
  static constexpr std::string_view type_name = "temperature";
  double celsius = 0;
  TAKT_FIELDS(Temperature, (celsius, "degC"))
};

struct Reading {
  takt::ReadStatus status = takt::ReadStatus::no_data;
  double celsius = 0;
  int64_t stamp_ns = 0;  ///< when it was measured
};

class Thermometer : public takt::Device {
 public:
  /// In a job: what is there now. No call that waits.
  virtual Reading read(int64_t now_ns) = 0;
  takt::StampLaw stamp_law(const takt::JobTimes&) const override { return {}; }  // it measures when asked
};

class ThermometerNode final : public takt::DeviceNode {
 public:
  takt::Output<Temperature> measured{this, "temperature", "of the room"};

  explicit ThermometerNode(std::unique_ptr<Thermometer> thermometer) : thermometer_(std::move(thermometer)) {}
  void setup(takt::Setup& setup) override { open_in_setup(setup); }
  takt::Device& device() override { return *thermometer_; }
  void run(takt::Job& job) override {
    if (!running(job)) return job.no_result();
    const Reading reading = thermometer_->read(job.release_ns());
    if (!accept(reading.status, job)) return;
    Temperature* message = measured.loan();
    if (message == nullptr) return job.no_result();
    message->celsius = reading.celsius;
    measured.send(reading.stamp_ns);
  }

 private:
  std::unique_ptr<Thermometer> thermometer_;
};
