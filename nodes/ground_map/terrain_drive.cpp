// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/terrain_drive.hpp"

#include <algorithm>
#include <random>

#include "nodes/ground_map/ground_detector.hpp"
#include "rt/msg/ace/terrain.hpp"

namespace takt::ground_map {
namespace {

PavementPart part_of(size_t kind, double from_y_m) {
  switch (kind) {
    case terrain_kind::left: return {from_y_m, -1.1, 2.4};
    case terrain_kind::right: return {from_y_m, -2.4, 1.1};
    case terrain_kind::crossing: return {from_y_m, -4.8, 4.8};
    case terrain_kind::unknown: return {from_y_m, -2, 2, Surface::bricks, 0.7};
    default: return {from_y_m, -1.75, 1.75};
  }
}

/// What a low scanner says of the reference area: whether nothing stands in it.
bool nothing_stands_in(const ReferenceArea& area, const FloorProjection& in_map, const PavementScene& scene) {
  for (const RowSpan& span : area.spans())
    for (int x = span.first; x < span.last; x += 4)
      if (const auto p = in_map.floor_at(x, span.y); p && scene.occupied(*p)) return false;
  return true;
}

}  // namespace

TerrainDrive::TerrainDrive(const TerrainDriveOptions& options) {
  std::mt19937_64 random(options.seed);
  for (int pass = 0; pass < options.passes; ++pass) {
    for (size_t kind = 0; kind < kHypotheses; ++kind) kinds_.push_back(kind);
    for (size_t left = kHypotheses; left > 1; --left)  // the shuffle of Fisher and Yates
      std::swap(*(kinds_.end() - static_cast<ptrdiff_t>(left)),
                *(kinds_.end() - static_cast<ptrdiff_t>(left) + static_cast<ptrdiff_t>(random() % left)));
  }
  pavement_.seed = options.seed;
  pavement_.width = 320;
  pavement_.height = 240;
  pavement_.frame_step_m = options.frame_step_m;
  pavement_.frames = static_cast<int>(static_cast<double>(kinds_.size()) * options.part_m / options.frame_step_m);
  pavement_.obstacles_from_m = 6;
  pavement_.parts.clear();
  for (size_t i = 0; i < kinds_.size(); ++i)
    pavement_.parts.push_back(part_of(kinds_[i], i == 0 ? -1e9 : static_cast<double>(i) * options.part_m));
}

void TerrainDrive::run(
    const TerrainShape& shape,
    const std::function<void(std::span<const int16_t> around, std::optional<size_t> truth)>& seen) const {
  const PavementScene scene(pavement_);
  GroundDetector detector(pavement_.width, pavement_.height, {});
  GroundGrid grid(pavement_.width, {});
  const FloorProjection in_robot = floor_projection(scene.camera(), scene.camera_in_robot());
  const size_t pixels = static_cast<size_t>(pavement_.width) * static_cast<size_t>(pavement_.height);
  std::vector<uint8_t> bgr(3 * pixels), truth(pixels), mask(pixels);
  const ImageView<uint8_t> image(bgr.data(), pavement_.width, pavement_.height, 3),
      truth_view(truth.data(), pavement_.width, pavement_.height),
      mask_view(mask.data(), pavement_.width, pavement_.height);
  std::vector<int16_t> around(shape.cells());
  for (int frame = 0; frame < pavement_.frames; ++frame) {
    scene.render(frame, image, truth_view);
    const PlanarPose robot = scene.robot_in_map(frame);
    map_image(image, in_robot, robot, detector, grid, mask_view,
              nothing_stands_in(detector.area(), in_robot.moved(robot), scene));
    cells_around(grid.map(), grid.window(), robot, shape, around);
    const std::optional<size_t> part = scene.part_seen(frame);
    seen(around, part ? std::optional(kinds_[*part]) : std::nullopt);
  }
}

}  // namespace takt::ground_map
