// SPDX-License-Identifier: Apache-2.0
#include "graph/world/ros_schemas.hpp"

#include <algorithm>
#include <limits>

namespace takt::world::ros {

void Returns::fill(std::byte* to) const {
  for (const float range : range_m) {
    const float shown = range > 0 ? range : std::numeric_limits<float>::infinity();
    std::memcpy(to, &shown, sizeof shown);
    to += sizeof shown;
  }
}

void Percent::fill(std::byte* to) const {
  constexpr int kPerMilleInPercent = 10, kMost = 100;
  for (int y = 0; y < cells.height; ++y)
    for (int x = 0; x < cells.width; ++x) {
      const int cell = cells.data[y * cells.stride + x];
      const int percent = cell < 0 ? -1 : std::min((cell + kPerMilleInPercent / 2) / kPerMilleInPercent, kMost);
      *to++ = static_cast<std::byte>(static_cast<int8_t>(percent));
    }
}

}  // namespace takt::world::ros
