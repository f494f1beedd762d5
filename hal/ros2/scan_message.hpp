// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace takt::ros2 {

/// What scans of a device must be like.
struct ScanRule {
  uint32_t beams = 0;
  double first_angle_rad = 0, step_rad = 0;
  double max_range_m = 0;
  std::string frame;  ///< empty: any
};

/// Reads a sensor_msgs/msg/LaserScan into `range_m`, which has ScanRule::beams elements: 0 where there is no return
/// (not a number, infinite, beyond the ranges of the message or of the rule). Null, or why it is refused: a literal.
/// `stamp_ns`: as the message has it, since 1970. Never throws, never allocates.
const char* read_scan(std::span<const std::byte> cdr, const ScanRule& rule, std::span<float> range_m,
                      int64_t& stamp_ns);

}  // namespace takt::ros2
