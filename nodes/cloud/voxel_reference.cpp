// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_reference.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>  // replay: tests and benchmarks call this file, no node does
#include <unordered_set>  // replay: likewise

#include "rt/msg/point.hpp"

namespace takt::cloud {
namespace {

struct Hash {
  size_t operator()(const VoxelIndex& v) const {
    return (static_cast<size_t>(v.x) * 73856093u) ^ (static_cast<size_t>(v.y) * 19349663u) ^
           (static_cast<size_t>(v.z) * 83492791u);
  }
};
using Voxels = std::unordered_map<VoxelIndex, Voxel, Hash>;  // replay: likewise
using Indices = std::unordered_set<VoxelIndex, Hash>;        // replay: likewise

Voxels sorted_into_voxels(const CloudView& cloud, double edge_m) {
  Voxels voxels;
  const VoxelSize size(edge_m);
  for (size_t i = 0; i < cloud.points.size(); ++i)
    if (size.holds(cloud.points[i]))
      voxels[size.voxel_of(cloud.points[i])].add(cloud.points[i], cloud.coloured() ? cloud.colours[i] : Colour{});
  return voxels;
}

/// Calls visit(neighbour) for the cube of voxels around one, itself included, by z, then y, then x.
template <class Visit>
void for_each_around(const VoxelIndex& v, int half_width, const Visit& visit) {
  for (int z = v.z - half_width; z <= v.z + half_width; ++z)
    for (int y = v.y - half_width; y <= v.y + half_width; ++y)
      for (int x = v.x - half_width; x <= v.x + half_width; ++x) visit(VoxelIndex{x, y, z});
}

Indices grown_by_one(const Voxels& voxels) {
  Indices grown;
  for (const auto& [index, voxel] : voxels)
    for_each_around(index, 1, [&grown](const VoxelIndex& near) { grown.insert(near); });
  return grown;
}

void add(Cloud& cloud, const Point& point, const Colour& colour) {
  cloud.points.push_back(point);
  cloud.colours.push_back(colour);
}

}  // namespace

Cloud reduce_reference(const CloudView& cloud, double edge_m) {
  Cloud out;
  for (const auto& [index, voxel] : sorted_into_voxels(cloud, edge_m)) add(out, voxel.mean(), voxel.mean_colour());
  return out;
}

Cloud smooth_reference(const CloudView& cloud, const SmoothParameters& parameters) {
  const Voxels voxels = sorted_into_voxels(cloud, parameters.edge_m);
  Cloud out;
  for (const VoxelIndex& index : grown_by_one(voxels)) {
    WeightedMean mean;
    double number = 0;
    size_t tap = 0;
    for_each_around(index, 1, [&](const VoxelIndex& near) {
      const int weight = kSmoothingKernel[tap++];
      const auto found = voxels.find(near);
      if (found == voxels.end()) return;
      number += static_cast<double>(weight) * found->second.points;
      mean.add(weight, found->second);
    });
    if (number > 0 && number >= parameters.t_occ * kKernelSum) add(out, mean.point(), mean.colour());
  }
  return out;
}

Cloud interpolate_reference(const CloudView& cloud, const InterpolateParameters& parameters) {
  Voxels voxels = sorted_into_voxels(cloud, parameters.edge_m);
  Cloud out;
  for (auto& [index, voxel] : voxels) {
    add(out, voxel.mean(), voxel.mean_colour());
    voxel = {voxel.x / voxel.points,
             voxel.y / voxel.points,
             voxel.z / voxel.points,
             out.colours.back().b,
             out.colours.back().g,
             out.colours.back().r,
             1};
  }
  struct Candidate {
    double distance2;
    VoxelIndex index;
    const Voxel* voxel;
  };
  const double r_max = parameters.reach * parameters.edge_m;
  const auto k = static_cast<size_t>(parameters.k);
  for (const VoxelIndex& gap : grown_by_one(voxels)) {
    int neighbours = 0;
    for_each_around(gap, 1, [&](const VoxelIndex& near) { neighbours += static_cast<int>(voxels.count(near)); });
    if (voxels.count(gap) != 0 || neighbours < parameters.n_adj) continue;
    const auto centre = VoxelSize(parameters.edge_m).centre_of(gap);
    std::vector<Candidate> near;
    for_each_around(gap, static_cast<int>(std::ceil(parameters.reach)) + 1, [&](const VoxelIndex& index) {
      const auto found = voxels.find(index);
      if (found == voxels.end()) return;
      const double dx = found->second.x - centre[0], dy = found->second.y - centre[1], dz = found->second.z - centre[2];
      near.push_back({dx * dx + dy * dy + dz * dz, index, &found->second});
    });
    // Equally far ones stay in the order of for_each_around.
    std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.distance2 < b.distance2; });
    if (near.size() < k || near[k - 1].distance2 > r_max * r_max) continue;
    WeightedMean mean;
    for (size_t i = 0; i < k; ++i) mean.add(1 / std::max(std::sqrt(near[i].distance2), 1e-6), *near[i].voxel);
    add(out, mean.point(), mean.colour());
  }
  return out;
}

}  // namespace takt::cloud
