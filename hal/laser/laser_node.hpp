// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <memory>

#include "hal/device_node.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "rt/msg/laser_scan.hpp"

namespace takt {

/// Device kind `laser_scanner`: one LaserScan per release.
class LaserNode final : public DeviceNode {
 public:
  explicit LaserNode(std::unique_ptr<LaserScanner> scanner) : scanner_(std::move(scanner)) {}
  void setup(Setup& setup) override;
  void run(Job& job) override;
  /// The stamp is that of the first beam: a sweep before its end, and before that what the line to the scanner takes.
  int64_t stamp_lag_ns() const override {
    return static_cast<int64_t>(1e9 * std::max(format_.sweep_s, format_.stamp_lag_s));
  }
  Device& device() override { return *scanner_; }

 private:
  Output<LaserScan> scan_{this, "scan", "newest complete sweep"};
  std::unique_ptr<LaserScanner> scanner_;
  ScanFormat format_;
};

}  // namespace takt
