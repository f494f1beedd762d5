// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/interaction/interaction.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/text_status.hpp"

namespace takt {

class InteractionNode;

/// The newest answer from a screen in another process. A parameter, so that it reaches the process of the device,
/// stands in the record and is shown as an event. Drivers without a screen refuse every value.
class AnswerParam final : public ParamBase {
 public:
  explicit AnswerParam(InteractionNode* owner);
  tl::expected<void, std::string> set(const ParamValue& value) override;
  std::string value_text() const override { return text_; }
  std::string range_text() const override { return ""; }
  std::string kind() const override { return "text"; }

 private:
  InteractionNode& owner_;
  std::string text_;
};

/// Device kind `interaction`: the newest task per release; says what is new in `speech`.
class InteractionNode final : public DeviceNode {
 public:
  explicit InteractionNode(std::unique_ptr<Interaction> person) : person_(std::move(person)) {}
  void setup(Setup& setup) override;
  void start(int64_t epoch_ns) override;
  void run(Job& job) override;
  Device& device() override { return *person_; }
  bool takes_answers() const override { return person_ != nullptr && person_->takes_answers(); }
  /// Between two jobs, or before start(): then it was taken by an earlier process of the run, which may have died
  /// before it gave the answer to anybody.
  bool answer(const std::string& words);

 private:
  Input<TextStatus> speech_{this, "speech", "what is said to the person; depth 4", Need::optional};
  Output<RobotTask> task_{this, "task", "the newest task, again with every job"};
  AnswerParam answer_{this};
  std::unique_ptr<Interaction> person_;
  bool started_ = false;
  std::string from_before_;  ///< the answer before start()
};

}  // namespace takt
