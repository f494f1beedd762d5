// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/depth_view.hpp"

#include <algorithm>

#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {

DepthCamera depth_camera_of(const CameraModel& model, int step_px, size_t most_pixels) {
  const double step = std::max(1, step_px);
  DepthCamera camera{0, 0, model.focal_px / step, model.cu_px / step, model.cv_px / step, 0};
  const auto side = [](double centre_px, size_t most) {
    return static_cast<int>(std::clamp(std::floor(2 * centre_px) + 1, 1.0, static_cast<double>(most)));
  };
  camera.width = side(camera.cu_px, most_pixels);
  camera.height = side(camera.cv_px, std::max<size_t>(1, most_pixels / static_cast<size_t>(camera.width)));
  if (model.baseline_m > 0) camera.step_per_m = 1 / (model.focal_px * model.baseline_m);
  return camera;
}

void draw(std::span<const Point> points, std::span<const Colour> colours, DepthView& view) {
  const DepthCamera& camera = view.camera;
  std::fill(view.depth_m.begin(), view.depth_m.end(), 0.0f);
  std::fill(view.colour.begin(), view.colour.end(), Colour{});
  const bool coloured = colours.size() == points.size() && !view.colour.empty();
  for (size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    if (!(p.z > 0)) continue;
    const double scale = camera.focal_px / p.z;
    const double u = p.x * scale + camera.cu_px + 0.5, v = p.y * scale + camera.cv_px + 0.5;
    if (!(u >= 0 && v >= 0 && u < camera.width && v < camera.height)) continue;
    const size_t at = static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u);
    if (view.depth_m[at] > 0 && view.depth_m[at] <= p.z) continue;
    view.depth_m[at] = p.z;
    if (coloured) view.colour[at] = colours[i];
  }
}

Warp warp_between(const DepthView& from, const DepthView& to) {
  const Affine m = to_affine(compose(inverse({to.camera_in_map, {}}), {from.camera_in_map, {}}).transform);
  // The target's intrinsics go into the rows, the source's into the columns.
  double rows[3][4];
  const double centre[2] = {to.camera.cu_px, to.camera.cv_px};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 4; ++k) {
      const double own = k < 3 ? m.r[3 * i + k] : m.t[i], depth = k < 3 ? m.r[6 + k] : m.t[2];
      rows[i][k] = i < 2 ? to.camera.focal_px * own + centre[i] * depth : depth;
    }
  Warp warp{};
  for (int i = 0; i < 3; ++i) {
    const double b = rows[i][0] / from.camera.focal_px, c = rows[i][1] / from.camera.focal_px;
    warp.a[i] = static_cast<float>(rows[i][2] - b * from.camera.cu_px - c * from.camera.cv_px);
    warp.b[i] = static_cast<float>(b);
    warp.c[i] = static_cast<float>(c);
    warp.t[i] = static_cast<float>(rows[i][3]);
  }
  return warp;
}

}  // namespace takt::mapping_3d
