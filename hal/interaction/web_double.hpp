// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "hal/device_double.hpp"
#include "hal/interaction/script.hpp"
#include "hal/interaction/web.hpp"

namespace takt {

/// Somebody before the robot's screen who presses what a script says, when it says it. An answer that the driver is not
/// ready for is pressed again. While it is `silent`, what is due is pressed and does not arrive.
class WebDouble final : public DeviceDouble {
 public:
  WebDouble(std::vector<TimedTask> script, std::shared_ptr<AnswerLine> screen)
      : script_(std::move(script)), screen_(std::move(screen)) {}
  /// Before the first run_to(): when the script's time begins.
  void begin(int64_t epoch_ns) { epoch_ns_ = epoch_ns; }
  DeviceResult plug_in() override { return {}; }
  void run_to(int64_t now_ns) override;
  int64_t step_ns() const override { return 10'000'000; }
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override { how_ = how; }

 private:
  std::vector<TimedTask> script_;
  std::shared_ptr<AnswerLine> screen_;
  int64_t epoch_ns_ = 0;
  size_t pressed_ = 0;
  Misbehaviour how_ = Misbehaviour::none;
};

}  // namespace takt
