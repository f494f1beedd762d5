// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/double_thread.hpp>: hal, experimental.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "hal/device_double.hpp"
#include "hal/device_thread.hpp"
#include "hal/settings/failures.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// A double that lives in real time beside the driver at the other end of its line, in a thread of its own, "double:"
/// and its id (15 letters at most), and misbehaves as it is scheduled. The thread is an ordinary one until a real-time
/// thread runs the driver's jobs; then it takes the lowest real-time priority, behind every worker: a device is not
/// slowed by what else the machine does.
class DoubleThread {
 public:
  /// `on_start`: called with the epoch before anything happens.
  DoubleThread(std::string id, std::unique_ptr<DeviceDouble> device, FailureSchedule failures, const Clock& clock,
               std::function<void(int64_t epoch_ns)> on_start);
  ~DoubleThread();
  DoubleThread(const DoubleThread&) = delete;
  DoubleThread& operator=(const DoubleThread&) = delete;

  /// Begins to live at the epoch. Later calls change nothing.
  void start(int64_t epoch_ns);
  /// What it can be told to do wrong while it lives.
  FaultSwitch& faults() { return failures_.by_hand(); }
  /// In a job of the driver.
  void keep_up();
  /// How late it was at most since the call before. One thread.
  int64_t late_ns();

 private:
  void work(int64_t epoch_ns);

  std::string id_;
  std::unique_ptr<DeviceDouble> device_;
  FailureSchedule failures_;
  const Clock& clock_;
  std::function<void(int64_t epoch_ns)> on_start_;
  std::atomic<bool> quit_{false};
  DevicePriority priority_;
  std::atomic<int64_t> due_ns_{INT64_MAX}, late_ns_{0};
  std::thread thread_;
};

}  // namespace takt
