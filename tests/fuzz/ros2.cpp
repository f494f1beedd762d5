// SPDX-License-Identifier: Apache-2.0
// Any bytes as a scan of ROS 2. Whatever they are: what is taken lies within the rule, and nothing beyond the bytes is
// read.
#include <algorithm>
#include <vector>

#include "hal/ros2/scan_message.hpp"
#include "tests/fuzz/require.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr float kUntouched = -7;
  const ros2::ScanRule rule{.beams = 3, .first_angle_rad = -0.5, .step_rad = 0.5, .max_range_m = 20, .frame = ""};
  std::vector<float> range(rule.beams + 1, kUntouched);
  int64_t stamp_ns = -1;
  const char* why = ros2::read_scan(std::as_bytes(std::span(data, size)), rule, {range.data(), rule.beams}, stamp_ns);
  require(range.back() == kUntouched);
  if (why != nullptr) return 0;
  require(stamp_ns >= 0);
  require(std::all_of(range.begin(), range.end() - 1, [&](float r) { return r >= 0 && r <= 20; }));
  return 0;
}
