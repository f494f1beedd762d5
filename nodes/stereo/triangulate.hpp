// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>

#include "nodes/stereo/matcher.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::stereo {

/// Points and colours of every `step`-th pixel (both directions, from pixel 0) with a disparity above 0, refined by its
/// fraction if there is one, in the camera frame (X right, Y down, Z forward, metres): Z = f B / d, X = (i - cu) Z / f,
/// Y = (j - cv) Z / f (thesis App. C). `image` is the left rectified image of the same size, 1 (grey) or 3 (BGR)
/// channels. Stops when a span is full. Returns how many points were written; 0 for a camera without focal length or
/// baseline.
inline size_t triangulate(const DisparityViews& map, ImageView<const uint8_t> image, const CameraModel& camera,
                          int step, std::span<Point> points, std::span<Colour> colours) {
  if (!(camera.focal_px > 0) || !(camera.baseline_m > 0) || step < 1) return 0;
  const size_t room = std::min(points.size(), colours.size());
  const double focal_baseline = camera.focal_px * camera.baseline_m;
  const int green = image.channels == 3 ? 1 : 0, red = image.channels == 3 ? 2 : 0;
  size_t count = 0;
  for (int y = 0; y < map.disparity.height; y += step)
    for (int x = 0; x < map.disparity.width; x += step) {
      if (map.disparity.at(x, y) <= 0) continue;
      if (count == room) return count;
      double d = map.disparity.at(x, y);
      if (map.fraction.data != nullptr) d += static_cast<double>(map.fraction.at(x, y) - kNoFraction) / kFractions;
      const double z = focal_baseline / d, scale = camera.baseline_m / d;
      points[count] = {static_cast<float>((x - camera.cu_px) * scale), static_cast<float>((y - camera.cv_px) * scale),
                       static_cast<float>(z)};
      colours[count] = {image.at(x, y, 0), image.at(x, y, green), image.at(x, y, red)};
      ++count;
    }
  return count;
}

}  // namespace takt::stereo
