// SPDX-License-Identifier: Apache-2.0
#include "graph/world/schemas.hpp"

#include <algorithm>
#include <limits>

namespace takt::world {

Time time_of(int64_t ns) {
  constexpr int64_t kSecond = 1'000'000'000;
  const int64_t rest = (ns % kSecond + kSecond) % kSecond;
  const int64_t seconds = ns / kSecond - (ns % kSecond < 0 ? 1 : 0);
  using Limits = std::numeric_limits<int32_t>;
  return {static_cast<int32_t>(std::clamp<int64_t>(seconds, Limits::min(), Limits::max())),
          static_cast<uint32_t>(rest)};
}

Quaternion rotation_of(const Transform& t) { return {t.qx, t.qy, t.qz, t.qw}; }

PoseOf pose_of(const Transform& t) { return {{t.x, t.y, t.z}, rotation_of(t)}; }

void PackedPoints::fill(std::byte* to) const {
  for (size_t i = 0; i < points.size(); ++i, to += kStride) {
    const Colour colour = i < colours.size() ? colours[i] : Colour{255, 255, 255};
    const uint8_t rgba[]{colour.r, colour.g, colour.b, 255}, bgr0[]{colour.b, colour.g, colour.r, 0};
    static_assert(sizeof(Point) + sizeof rgba == kStride);
    std::memcpy(to, &points[i], sizeof(Point));
    std::memcpy(to + sizeof(Point), order == Order::rgba ? rgba : bgr0, sizeof rgba);
  }
}

void Widened::fill(std::byte* to) const {
  for (const float value : values) {
    const double wide = value;
    std::memcpy(to, &wide, sizeof wide);
    to += sizeof wide;
  }
}

}  // namespace takt::world
