// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/base/mobile_base.hpp"
#include "hal/device_node.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt {

/// Device kind `mobile_base`: odometry per release; passes the newest velocity command on, or zero while a
/// connected `stop` says stop or is silent, and always in the mode safe_stop.
class BaseNode final : public DeviceNode {
 public:
  explicit BaseNode(std::unique_ptr<MobileBase> base) : base_(std::move(base)) {}
  void setup(Setup& setup) override { open_in_setup(setup); }
  void run(Job& job) override;
  Device& device() override { return *base_; }

 private:
  Input<VelocityCommand> velocity_{this, "velocity", "wanted speeds", Need::optional};
  Input<StopCommand> stop_{this, "stop", "drive only while it says so", Need::optional};
  Output<Odometry> odometry_{this, "odometry", "pose and speeds in the drifting odometry frame"};
  std::unique_ptr<MobileBase> base_;
};

}  // namespace takt
