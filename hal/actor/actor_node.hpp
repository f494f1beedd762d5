// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/actor/actor.hpp"
#include "hal/device_node.hpp"
#include "rt/msg/ace/action.hpp"

namespace takt {

/// Device kind `actor`: passes the newest action on, except in the mode safe_stop, and says how far it is.
class ActorNode final : public DeviceNode {
 public:
  explicit ActorNode(std::unique_ptr<Actor> actor) : actor_(std::move(actor)) {}
  void setup(Setup& setup) override { open_in_setup(setup); }
  void run(Job& job) override;
  Device& device() override { return *actor_; }

 private:
  Input<ActionCommand> command_{this, "command", "wanted action", Need::optional};
  Output<ActionOutcome> outcome_{this, "outcome", "how far the action of the newest command is"};
  std::unique_ptr<Actor> actor_;
};

}  // namespace takt
