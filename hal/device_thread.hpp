// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_thread.hpp>: hal, experimental.
// The threads that devices keep in addition to the workers of the runtime.
#pragma once
#include <atomic>
#include <cstdint>

#include "rt/time/clock.hpp"

namespace takt {

/// Whether a thread leaves the CPU to others. One that does not (a double that is too slow for its machine, a line that
/// somebody floods) must not be real-time: the ordinary thread that ends the run would never get a CPU.
class LeavesTime {
 public:
  /// `now_ns`: of any clock; `used_ns`: CPU time of the thread so far. False from the window on in which it used more
  /// than 80 % of the time, until one in which it used less than half. A window lasts 200 ms or more.
  bool at(int64_t now_ns, int64_t used_ns);

 private:
  int64_t from_ns_ = INT64_MIN, used_before_ns_ = 0;
  bool leaves_ = true;
};

/// The priority of a device's thread:
///
///     void read() { priority_.follow(); ... }             // in a job of the driver
///     void work() { while (...) { priority_.keep(clock_); ... } }  // in the thread
///
/// The thread is an ordinary one until a real-time thread runs the driver's jobs. Then it has the lowest real-time
/// priority, behind every worker, as long as it leaves time to others. Where the kernel refuses, it stays as it is.
class DevicePriority {
 public:
  /// In a job of the driver.
  void follow();
  /// In the thread, once a round; in the first one it also gives up what the thread inherited.
  void keep(const Clock& clock);

 private:
  enum class Has : uint8_t { inherited, ordinary, real_time };
  void take(Has what);

  std::atomic<bool> wanted_{false};
  Has has_ = Has::inherited;
  LeavesTime leaves_time_;
};

}  // namespace takt
