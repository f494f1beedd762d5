// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "graph/bringup/brought_up.hpp"
#include "graph/bringup/trial_run.hpp"

namespace takt::bringup {

/// Who stands beside the robot.
class Person {
 public:
  virtual ~Person() = default;
  virtual void hears(const std::string& text) = 0;
  /// Waits for the answer. Nothing: nobody answers any more.
  virtual std::optional<bool> agrees(const std::string& question) = 0;
};

struct TrialOptions {
  command::RunOptions run;  ///< graph and profile; `output` gets logs and pictures
  double watched_s = 5;     ///< so long a device is looked at
  double patience_s = 60;   ///< for what a person is to do
  double speed_m_s = 0.1;   ///< of the base
};

/// Runs one device alone and asks the person whether it says what is so. A base drives, with its wheels lifted.
Trial try_device(const Registry& registry, const TrialOptions& options, const graph::DeviceSpec& device,
                 Person& person);

/// Runs the whole graph with the base driving slowly on the ground: it must stop for a person who steps in its way, go
/// on behind him, and stop for the emergency stop where the graph has lines.
Trial try_stop(const Registry& registry, const TrialOptions& options, const graph::GraphSpec& graph,
               const std::string& base, Person& person);

}  // namespace takt::bringup
