// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/interaction/interaction.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/text_status.hpp"

namespace takt {

/// Device kind `interaction`: the newest task per release; says what is new in `speech`.
class InteractionNode final : public DeviceNode {
 public:
  explicit InteractionNode(std::unique_ptr<Interaction> person) : person_(std::move(person)) {}
  void setup(Setup& setup) override;
  void start(int64_t epoch_ns) override;
  void run(Job& job) override;
  Device& device() override { return *person_; }

 private:
  Input<TextStatus> speech_{this, "speech", "what is said to the person; depth 4", Need::optional};
  Output<RobotTask> task_{this, "task", "the newest task, again with every job"};
  std::unique_ptr<Interaction> person_;
};

}  // namespace takt
