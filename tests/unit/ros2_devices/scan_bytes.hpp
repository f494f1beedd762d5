// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace takt::test {

/// A LaserScan of ROS 2 as a middleware writes it.
struct ScanBytes {
  int32_t seconds = 12;
  uint32_t nanoseconds = 34;
  std::string frame = "laser";
  float first_rad = -0.5f, step_rad = 0.5f;
  std::vector<float> ranges{1, 2, 3}, intensities{};

  std::vector<std::byte> bytes(bool big_endian = false) const {
    std::vector<std::byte> all{std::byte{0}, std::byte{static_cast<unsigned char>(big_endian ? 0 : 1)}, {}, {}};
    const auto number = [&](auto value) {
      while ((all.size() - 4) % sizeof value != 0) all.push_back({});
      std::byte raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (big_endian) std::reverse(std::begin(raw), std::end(raw));
      all.insert(all.end(), std::begin(raw), std::end(raw));
    };
    number(seconds), number(nanoseconds);
    number(static_cast<uint32_t>(frame.size() + 1));
    for (const char c : frame) all.push_back(static_cast<std::byte>(c));
    all.push_back({});
    const float last_rad = first_rad + step_rad * 2, least_m = 0.1f, most_m = 50;
    for (const float value : {first_rad, last_rad, step_rad, 0.0f, 0.1f, least_m, most_m}) number(value);
    for (const auto* values : {&ranges, &intensities}) {
      number(static_cast<uint32_t>(values->size()));
      for (const float value : *values) number(value);
    }
    return all;
  }
};

}  // namespace takt::test
