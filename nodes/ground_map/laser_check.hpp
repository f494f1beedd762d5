// SPDX-License-Identifier: Apache-2.0
// Whether a low laser scanner sees something standing in the reference area (thesis Sec. 4.2.1; ).
#pragma once
#include "nodes/ground_map/floor_projection.hpp"
#include "nodes/ground_map/texture.hpp"
#include "rt/msg/laser_scan.hpp"

namespace takt::ground_map {

/// True if no return lies above the floor that the reference area shows. `projection` leads to the robot frame. Holes
/// cannot be seen this way.
bool area_is_free(const LaserScan& scan, const FloorProjection& projection, const ReferenceArea& area);

}  // namespace takt::ground_map
