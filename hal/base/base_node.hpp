// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/base/mobile_base.hpp"
#include "hal/device_node.hpp"

namespace takt {

/// Device kind `mobile_base`: odometry per release; passes the newest velocity command on.
class BaseNode final : public DeviceNode {
 public:
  explicit BaseNode(std::unique_ptr<MobileBase> base) : base_(std::move(base)) {}
  void setup(Setup&) override { open_in_setup(); }
  void run(Job& job) override;
  Device& device() override { return *base_; }

 private:
  Input<VelocityCommand> velocity_{this, "velocity", "wanted speeds", Need::optional};
  Output<Odometry> odometry_{this, "odometry", "pose and speeds in the drifting odometry frame"};
  std::unique_ptr<MobileBase> base_;
};

}  // namespace takt
