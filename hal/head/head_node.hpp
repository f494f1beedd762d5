// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/head/camera_head.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/head.hpp"

namespace takt {

/// Device kind `camera_head`: its state per release; passes the newest command on.
class HeadNode final : public DeviceNode {
 public:
  explicit HeadNode(std::unique_ptr<CameraHead> head) : head_(std::move(head)) {}
  void setup(Setup& setup) override { open_in_setup(setup); }
  void run(Job& job) override;
  Device& device() override { return *head_; }

 private:
  Input<HeadCommand> command_{this, "command", "wanted pan and tilt", Need::optional};
  Input<DigitalState> lids_{this, "lids", "line 0: close the left lid, line 1: the right one", Need::optional};
  Output<HeadState> state_{this, "state", "measured pan and tilt"};
  std::unique_ptr<CameraHead> head_;
};

}  // namespace takt
