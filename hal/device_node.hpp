// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_node.hpp>: hal, experimental.
#pragma once
#include <memory>

#include "hal/device.hpp"
#include "hal/device_health.hpp"
#include "hal/double_thread.hpp"
#include "rt/node.hpp"

namespace takt {

class DeviceNode;

/// What `takt fault` has switched on: `none`, or a fault that the simulated device or double knows. A parameter, so
/// that it outlives the process and stands in the record. Hardware refuses every value.
class FaultParam final : public ParamBase {
 public:
  static constexpr std::string_view kName = "fault";
  explicit FaultParam(DeviceNode* owner);
  tl::expected<void, std::string> set(const ParamValue& value) override;
  std::string value_text() const override { return std::string(to_text(on_)); }
  std::string range_text() const override { return ""; }
  std::string kind() const override { return "choice"; }

 private:
  DeviceNode& owner_;
  Misbehaviour on_ = Misbehaviour::none;
};

/// A node that feeds a device's data into the graph. The runtime starts the device at the epoch and stops it after the
/// last job. Each job judges the device by what it read, and says so to the runtime. A device that did not start, or
/// that says it is gone, is tried again by the jobs, ever more seldom (RetryDelay).
class DeviceNode : public Node {
 public:
  DeviceResult start_device(int64_t epoch_ns) {
    DeviceResult result = device().start(epoch_ns);
    started_ = result.has_value();
    return result;
  }
  void stop_device() {
    device().stop();
    started_ = false;
  }
  void start(int64_t epoch_ns) override {
    if (double_) double_->start(epoch_ns);
    static_cast<void>(start_device(epoch_ns));
  }
  void finish() override { stop_device(); }
  virtual Device& device() = 0;
  /// How old what its jobs send can be: of hardware what it told before it was opened.
  virtual StampLaw stamp_law(const JobTimes& jobs) { return declared_ ? *declared_ : device().stamp_law(jobs); }
  /// Before the device is opened: what it tells now is what admission counts on.
  void declare() { declared_ = device().stamp_law({}); }
  /// Once it is open: why what it tells now is more than it declared; empty if it is not.
  std::string broken_declaration();
  /// Before setup: what the graph says of the device's health.
  void set_health(const DeviceHealthSettings& settings) { health_settings_ = settings; }
  /// Before the start: what stands at the other end of the device's line lives as long as the node does.
  void live_with(std::unique_ptr<DoubleThread> device) { double_ = std::move(device); }
  /// Of its double or simulated device; null: nothing can be made to go wrong with it.
  FaultSwitch* faults() { return double_ ? &double_->faults() : device().faults(); }
  /// The text parameter that answers of people come in by, where takes_answers().
  static constexpr std::string_view kAnswer = "answer";
  /// Whether people answer it from a screen in another process (the question `answer` to a running graph).
  virtual bool takes_answers() const { return false; }
  /// The bits of these (fault_bits); 0: none.
  uint32_t known_faults();
  /// Before setup: the device is not opened there. Such a node tells its capacities, and never runs.
  void leave_closed() { opens_ = false; }

 protected:
  /// In setup: opens the device.
  void open_in_setup(const Setup& setup);
  /// In a job: false if the device is not there, and was not to be had back now (the job then has no result).
  bool running(Job& job);
  /// In a job: judges a read and says what one without data means; true if there is something to send. Of damaged data
  /// only what can be marked as such is sent: `marks_damage` says that the message has a place for it. `repeated`: the
  /// data are those of the job before.
  bool accept(ReadStatus status, Job& job, bool marks_damage = false, bool repeated = false);
  /// In the mode in which the robot stays where it is; in a mode without a name nobody has said that it may move.
  static bool stands(std::string_view mode) { return mode.empty() || mode == kSafeStopMode; }

 private:
  void judge(ReadStatus status, Job& job, bool repeated);

  FaultParam fault_{this};
  bool opens_ = true, started_ = false;
  std::optional<StampLaw> declared_;
  DeviceHealthSettings health_settings_;
  DeviceHealth health_{health_settings_};
  RetryDelay retry_;
  uint64_t reopen_tries_ = 0;
  std::unique_ptr<DoubleThread> double_;  ///< null: the device is a real one, or simulated
};

}  // namespace takt
