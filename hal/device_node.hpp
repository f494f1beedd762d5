// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"
#include "rt/node.hpp"

namespace takt {

/// A node that feeds a device's data into the graph. The runtime starts the device at the epoch and stops it after the
/// last job; a device that did not start then is tried again by each job.
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
  void start(int64_t epoch_ns) override { static_cast<void>(start_device(epoch_ns)); }
  void finish() override { stop_device(); }
  virtual Device& device() = 0;
  /// After setup: how long before the planned release of a job the stamp of its message may lie, ns. 0 for a device
  /// that captures when asked.
  virtual int64_t stamp_lag_ns() const { return 0; }

 protected:
  /// In a job: false if the device cannot be started (the job then has no result).
  bool running(const Job& job) { return started_ || start_device(job.release_ns()).has_value(); }
  /// Says what a read without data means; true if there is something to send.
  static bool accept(ReadStatus status, Job& job) {
    if (status == ReadStatus::end_of_data) job.end_of_data();
    else if (status != ReadStatus::ok && status != ReadStatus::partial) job.no_result();
    return status == ReadStatus::ok || status == ReadStatus::partial;
  }
  void open_in_setup() {
    if (const auto opened = device().open(); !opened) throw SetupError(opened.error().text());
    const DeclaredCalls declared = device().declared_calls();
    if (declared.calls != 0) may(declared.calls, declared.reason);
  }

 private:
  bool started_ = false;
};

}  // namespace takt
