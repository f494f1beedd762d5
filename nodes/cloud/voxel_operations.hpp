// SPDX-License-Identifier: Apache-2.0
// What is done with a cloud that lies in a voxel grid (thesis Sec. 3.3.1). Each writes into `out` what it makes of the
// cloud that the grid was filled with; that may be the memory the cloud came from. None allocates.
#pragma once
#include <array>

#include "nodes/cloud/voxel_grid.hpp"

namespace takt::cloud {

/// One point a voxel: mean position and colour. In the order of the grid.
void reduce(const VoxelGrid& grid, CloudBuffer& out);

/// Smoothing kernel, in units of 1/40, layer by layer (thesis Eq. 3.9); a Gaussian of 0.64 voxels without its corners.
inline constexpr std::array<int, 27> kSmoothingKernel{0, 1, 0, 1, 3,  1, 0, 1, 0,  //
                                                      1, 3, 1, 3, 10, 3, 1, 3, 1,  //
                                                      0, 1, 0, 1, 3,  1, 0, 1, 0};
inline constexpr int kKernelSum = 40;

struct SmoothParameters {
  double edge_m = 0.02;
  double t_occ = 0.25;  ///< convolved count, points, that a voxel needs to hold a point afterwards; 0..1
};

/// Number, positions and colours of the points of each voxel are convolved with the kernel; a voxel whose
/// number then is at least t_occ, and not 0, gives one point: position sum / number, colour likewise.
void smooth(VoxelGrid& grid, double t_occ, CloudBuffer& out);

struct InterpolateParameters {
  double edge_m = 0.02;
  int n_adj = 4;  ///< occupied voxels among its 26 neighbours that make an empty voxel a gap; 1..26
  int k = 4;      ///< nearest points that it is reconstructed from; 1..kMostNearest
  double reach =
      2;  ///< farther than this, in edges, none of these may be (r_max = reach * edge_m); 0.5..kFarthestReach
};
inline constexpr int kMostNearest = 16;
inline constexpr double kFarthestReach = 4;

/// First one point a voxel, as reduce gives; then, for each gap with k of these points within reach of its centre c,
/// the mean of these k, weighted with 1 / max(distance to c, 1e-6 m). Of points at the same distance the one whose
/// voxel comes first in z, y, x is nearer. The grid is left averaged.
void interpolate(VoxelGrid& grid, const InterpolateParameters& parameters, CloudBuffer& out);

}  // namespace takt::cloud
