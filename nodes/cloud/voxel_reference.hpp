// SPDX-License-Identifier: Apache-2.0
// Slow, obvious versions of voxel_operations.hpp: a hash map from voxel to points, every neighbour looked up. They give
// the same points, bit for bit, in an order of their own. Parameters as there.
#pragma once
#include "nodes/cloud/voxel_operations.hpp"

namespace takt::cloud {

Cloud reduce_reference(const CloudView& cloud, double edge_m);
Cloud smooth_reference(const CloudView& cloud, const SmoothParameters& parameters);
Cloud interpolate_reference(const CloudView& cloud, const InterpolateParameters& parameters);

}  // namespace takt::cloud
