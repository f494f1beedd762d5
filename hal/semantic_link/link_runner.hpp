// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "hal/device_thread.hpp"
#include "hal/semantic_link/link_end.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt::semantic_link {

/// Runs an end of the link for the devices that share it, on a thread of its own while at least one of them is started.
/// The thread is an ordinary one until a real-time thread asks it for something; then it takes the lowest real-time
/// priority. With a virtual clock there is no thread: each job steps. start, stop: composition thread.
class LinkRunner {
 public:
  LinkRunner(std::string name, std::unique_ptr<LinkEnd> end, const Clock& clock);
  ~LinkRunner();

  /// While a device is started, the thread sees to the port itself.
  DeviceResult open() { return users_ > 0 ? DeviceResult() : end_->open(); }
  void start();
  void stop();
  /// In a job: something is to be sent. One write to an eventfd; with a virtual clock a step.
  void wake();
  /// In a job: before it looks at what has come.
  void poll();
  bool is_virtual() const { return clock_.is_virtual(); }

 private:
  void work();

  std::string name_;
  std::unique_ptr<LinkEnd> end_;
  const Clock& clock_;
  Descriptor bell_;
  int users_ = 0;
  std::atomic<bool> quit_{false};
  DevicePriority priority_;
  std::thread thread_;
};

}  // namespace takt::semantic_link
