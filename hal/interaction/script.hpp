// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/interaction/interaction.hpp"

namespace takt {

struct TimedTask {
  int64_t after_ns = 0;  ///< since the epoch of the run
  std::string task;
};

/// "2s goal cup_1.level=full; 30s stop", times ascending. The error quotes the piece at fault.
tl::expected<std::vector<TimedTask>, std::string> parse_task_script(std::string_view text);

/// A person who says what a script says, when it says it, and does not listen. Number n is the n-th task, also after a
/// restart.
class ScriptedPerson final : public Interaction {
 public:
  /// `epoch`: fixes the beginning of the script's time, if nobody did before, and says when it is.
  ScriptedPerson(std::vector<TimedTask> script, std::function<int64_t(int64_t)> epoch)
      : script_(std::move(script)), epoch_(std::move(epoch)) {}
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override {
    epoch_ns_ = epoch_(epoch_ns);
    started_ = true;
    return {};
  }
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  InteractionReading read(int64_t wanted_ns) override;
  bool say(std::string_view) override { return started_; }

 private:
  std::vector<TimedTask> script_;
  std::function<int64_t(int64_t)> epoch_;
  int64_t epoch_ns_ = 0;
  bool started_ = false;
};

}  // namespace takt
