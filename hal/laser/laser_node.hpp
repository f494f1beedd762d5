// SPDX-License-Identifier: Apache-2.0
#pragma once
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
  Device& device() override { return *scanner_; }

 private:
  Output<LaserScan> scan_{this, "scan", "newest complete sweep"};
  std::unique_ptr<LaserScanner> scanner_;
  ScanFormat format_;
};

}  // namespace takt
