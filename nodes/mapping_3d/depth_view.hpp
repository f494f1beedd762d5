// SPDX-License-Identifier: Apache-2.0
// Depth images of a pinhole camera, where they were seen from, and how one looks from where another was.
#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::mapping_3d {

/// The image whose pixels became the points of a cloud. Pixel (u, v): x = (u - cu) z / f, y = (v - cv) z / f.
struct DepthCamera {
  int width = 0, height = 0;
  double focal_px = 0, cu_px = 0, cv_px = 0;
  double step_per_m = 0;  ///< what one disparity tells apart at a depth of 1 m: 1 / (f B) at full size; 0: no stereo

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  bool operator==(const DepthCamera&) const = default;
};

/// Of a cloud of every step-th pixel. The image is taken to be as wide on both sides of its principal point, and as
/// high, but to have at most so many pixels.
DepthCamera depth_camera_of(const CameraModel& model, int step_px, size_t most_pixels);

/// One depth image: metres along the optical axis, 0 where there is none. Without colours `colour` is empty.
struct DepthView {
  DepthCamera camera;
  Transform camera_in_map;
  std::span<float> depth_m;
  std::span<Colour> colour;
};

/// The nearest point of each pixel; a point counts for the pixel whose middle is next to it. `view.camera` says which
/// image, `view.depth_m` has its pixels; colours as many as points, or none.
void draw(std::span<const Point> points, std::span<const Colour> colours, DepthView& view);

/// From a pixel and its depth in one view to homogeneous pixel coordinates in another:
/// (u' d', v' d', d') = d (a + b u + c v) + t.
struct Warp {
  float a[3], b[3], c[3], t[3];
};
Warp warp_between(const DepthView& from, const DepthView& to);

/// Where a point of one view is in another.
struct Warped {
  int u = 0, v = 0;
  float depth_m = 0;
  bool inside = false;
};

/// In float and without fused operations: the kernels, which do the same for a row at once, give the same bits.
inline Warped warped(const Warp& w, int u, int v, float depth_m, const DepthCamera& to) {
  float h[3];
  for (int i = 0; i < 3; ++i)
    h[i] = depth_m * ((w.a[i] + w.c[i] * static_cast<float>(v)) + w.b[i] * static_cast<float>(u)) + w.t[i];
  const float inverse = 1.0f / h[2], x = h[0] * inverse + 0.5f, y = h[1] * inverse + 0.5f;
  Warped out{0, 0, h[2],
             h[2] > 0 && x >= 0 && y >= 0 && x < static_cast<float>(to.width) && y < static_cast<float>(to.height)};
  if (out.inside) out.u = static_cast<int>(x), out.v = static_cast<int>(y);
  return out;
}

}  // namespace takt::mapping_3d
