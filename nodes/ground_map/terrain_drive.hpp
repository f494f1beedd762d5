// SPDX-License-Identifier: Apache-2.0
// A generated drive past every kind of terrain, with its truth: what the ground map shows around the robot, image by
// image, for learning and for evaluation.
#pragma once
#include <functional>
#include <optional>

#include "nodes/ground_map/pavement_scene.hpp"
#include "nodes/ground_map/terrain.hpp"

namespace takt::ground_map {

struct TerrainDriveOptions {
  uint64_t seed = 1;
  int passes = 2;             ///< each kind, and "unknown", so often, in an order of its own
  double part_m = 10;         ///< length of each
  double frame_step_m = 0.2;  ///< 1 m/s at 5 Hz
};

/// Pavements that lie to the right of the robot, to its left, on both sides, and wide open ones; "unknown" is the
/// middle with the robot turned away from its way.
class TerrainDrive {
 public:
  explicit TerrainDrive(const TerrainDriveOptions& options);
  /// Drives, sees and maps with the defaults of the node; per image the cells around the robot, and the terrain_kind
  /// of what it sees, none where that are two.
  void run(const TerrainShape& shape,
           const std::function<void(std::span<const int16_t> around, std::optional<size_t> truth)>& seen) const;

 private:
  std::vector<size_t> kinds_;  ///< of the parts
  PavementOptions pavement_;
};

}  // namespace takt::ground_map
