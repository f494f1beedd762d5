// SPDX-License-Identifier: Apache-2.0
// The flat pieces of a room that a sweep has seen, and the mount of another scanner that lays its sweep onto them.
#pragma once
#include <map>
#include <span>

#include "nodes/calibration/laser_sweep.hpp"
#include "nodes/cloud/voxel_grid.hpp"
#include "nodes/laser_fusion/rigid_fit.hpp"
#include "rt/msg/point.hpp"

namespace takt::calibration {

struct Patch {
  Eigen::Vector3d middle, normal;  ///< m, unit
};

/// Space is cut into cubes, in the middle of whose lowest ones the floor lies; one whose points lie on a plane is a
/// patch: 10 of them at least, the variance across at most 2 % of the lesser one along it, and that at least 10 % of
/// the larger.
class RoomPatches {
 public:
  RoomPatches(std::span<const Point> room, double edge_m);

  /// Of the cube that a place lies in; null if there is none.
  const Patch* at(const Point& place) const;
  size_t size() const { return patches_.size(); }

 private:
  Point raised(const Point& p) const { return {p.x, p.y, p.z + static_cast<float>(cubes_.edge_m() / 2)}; }

  cloud::VoxelSize cubes_;
  std::map<cloud::VoxelIndex, Patch> patches_;
};

struct PatchFitParameters {
  size_t returns = 20'000;  ///< every n-th takes part, so that these are the most
  double edge_m = 0.2;      ///< of the cubes
  double cut_m = 0.05;      ///< a return farther from its patch belongs to something else
  double scale_m = 0.01;    ///< one that far from its patch counts half (Cauchy)
  laser_fusion::Locks locks{false, false, true, false, false, true};
};

struct PatchFit {
  PoseParameters mount{};
  double residual_m = 0;  ///< mean distance of the returns from their patches, before the step
  double paired = 0;      ///< share of the returns that have a patch within the cut
};

/// One step of Gauss-Newton on the weighted squares of those distances (point-to-plane ICP, Chen and Medioni 1991),
/// over the parameters that are not locked: points may slide along walls, so their spacing does not matter. Fewer than
/// six pairs: the mount stays.
PatchFit step_onto(const RoomPatches& room, const LaserSweep& sweep, const PoseParameters& mount,
                   const PatchFitParameters& parameters);

}  // namespace takt::calibration
