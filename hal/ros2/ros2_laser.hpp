// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/device_thread.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/newest.hpp"
#include "hal/ros2/scan_message.hpp"
#include "hal/ros2/source.hpp"
#include "hal/ros2/stamp_rule.hpp"

namespace takt::ros2 {

/// A laser scanner that a node of ROS 2 publishes. A thread of its own takes messages and checks them; read() takes the
/// newest good one and never waits. What is refused is counted as damaged, with the reason in trouble().
class Ros2Laser final : public LaserScanner {
 public:
  struct Parts {
    std::string id;
    ScanRule rule;
    StampRule stamps;
    double rate_hz = 0;
    Transform sensor_in_robot;
    /// Called in start(); throws std::runtime_error.
    std::function<std::unique_ptr<Source>()> listen;
    /// Wall clock, ns since 1970.
    std::function<int64_t()> wall_ns;
  };
  Ros2Laser(Parts parts, const Clock& clock) : parts_(std::move(parts)), clock_(clock) {}
  ~Ros2Laser() override { close(); }

  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  bool restart(int64_t now_ns) override;
  int64_t starts_within_ns() const override;
  ScanFormat format() const override;
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override;
  SourceCounts counts() const override { return {received_.load(), damaged_.load(), 0, 0, 0}; }
  const char* trouble() const override { return trouble_.load(std::memory_order_relaxed); }

  /// Takes what comes within so long. By the thread; in a test that has none, by the test.
  void step(int64_t patience_ns);

 private:
  struct Scan {
    std::vector<float> range_m;
    int64_t stamp_ns = 0;
    uint32_t number = 0;
  };
  void take(std::span<const std::byte> cdr);
  void refuse(const char* why);

  const Parts parts_;
  const Clock& clock_;
  bool open_ = false, started_ = false;
  std::unique_ptr<Source> source_;
  Newest<Scan> newest_;
  uint32_t number_ = 0;
  int64_t heard_ns_ = 0;  ///< of the reader: when there was a scan
  std::atomic<uint64_t> received_{0}, damaged_{0};
  std::atomic<const char*> trouble_{""};
  std::atomic<bool> quit_{false};
  DevicePriority priority_;
  std::thread thread_;
};

}  // namespace takt::ros2
