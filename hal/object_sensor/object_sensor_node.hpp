// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/object_sensor/object_sensor.hpp"
#include "rt/msg/ace/object_reports.hpp"

namespace takt {

/// Device kind `object_sensor`: the objects in view per release.
class ObjectSensorNode final : public DeviceNode {
 public:
  explicit ObjectSensorNode(std::unique_ptr<ObjectSensor> sensor) : sensor_(std::move(sensor)) {}
  void setup(Setup& setup) override;
  void run(Job& job) override;
  Device& device() override { return *sensor_; }

 private:
  Output<ObjectReports> objects_{this, "objects", "what is in view, in the robot frame"};
  std::unique_ptr<ObjectSensor> sensor_;
};

}  // namespace takt
