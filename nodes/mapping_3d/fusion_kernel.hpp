// SPDX-License-Identifier: Apache-2.0
// The parts of median fusion that treat many pixels alike. Buffers are read and written up to kFusionReadAhead elements
// past their end.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "nodes/mapping_3d/depth_view.hpp"

namespace takt::mapping_3d {

constexpr size_t kFusionReadAhead = 64;  ///< no vector has more floats

/// Row `v` of a view: for each depth above 0 the index of the pixel that it falls on in `to`, else -1; and its depth
/// there.
void warp_row(const Warp& warp, int v, const float* depth_m, int width, const DepthCamera& to, int32_t* pixel,
              float* warped_m);

/// What each view saw at a run of pixels, infinite for nothing.
struct SeenRun {
  const float* const* views = nullptr;
  size_t count = 0, first = 0, pixels = 0;
  float tolerance_per_m2 = 0, tolerance_least_m = 0;
};

/// The nearest depth of each pixel, and whether it may have to go: fewer views saw it or something nearer than saw
/// something farther. True if there is such a pixel.
bool nominate(const SeenRun& seen, float* candidate_m, int32_t* unsettled);

/// Of the depths alike to the candidate, if they are at least `support`, the lower median (or the candidate itself);
/// else 0.
void conclude(const SeenRun& seen, bool median, int support, const float* candidate_m, float* depth_m);

}  // namespace takt::mapping_3d
