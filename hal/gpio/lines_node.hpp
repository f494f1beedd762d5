// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/gpio/digital_lines.hpp"
#include "rt/msg/ace/digital_state.hpp"

namespace takt {

/// Device kind `digital_lines`: levels and edges per release.
class LinesNode final : public DeviceNode {
 public:
  explicit LinesNode(std::unique_ptr<DigitalLines> lines) : lines_(std::move(lines)) {}
  void setup(Setup& setup) override { open_in_setup(setup); }
  void run(Job& job) override;
  Device& device() override { return *lines_; }

 private:
  Output<DigitalState> state_{this, "state", "levels and edges; an emergency stop is active-low"};
  std::unique_ptr<DigitalLines> lines_;
};

}  // namespace takt
