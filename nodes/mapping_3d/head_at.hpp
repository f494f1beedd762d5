// SPDX-License-Identifier: Apache-2.0
// Where the camera head looked at the stamp of an image.
#pragma once
#include <cmath>
#include <optional>

#include "rt/msg/ace/head.hpp"
#include "rt/node.hpp"

namespace takt::mapping_3d {

struct HeadAngles {
  double pan_rad = 0, tilt_rad = 0;
};

/// Between two of the latched states, or by the last one if the head stood still then. None: not known, or the states
/// around the stamp lie more than `longest_gap_ns` from it.
inline std::optional<HeadAngles> head_at(const Input<HeadState>& head, int64_t stamp_ns, int64_t longest_gap_ns) {
  for (size_t i = head.size(); i-- > 0;) {
    const HeadState& before = head[i];
    const int64_t since_ns = stamp_ns - head.stamp_ns(i);
    if (since_ns < 0) continue;
    if (since_ns > longest_gap_ns) return std::nullopt;
    if (since_ns == 0 || before.moving == 0) return HeadAngles{before.pan_rad, before.tilt_rad};
    if (i + 1 == head.size()) return std::nullopt;
    const HeadState& after = head[i + 1];
    const double share = static_cast<double>(since_ns) / static_cast<double>(head.stamp_ns(i + 1) - head.stamp_ns(i));
    return HeadAngles{std::lerp(before.pan_rad, after.pan_rad, share),
                      std::lerp(before.tilt_rad, after.tilt_rad, share)};
  }
  return std::nullopt;
}

}  // namespace takt::mapping_3d
