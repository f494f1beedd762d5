// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/thinning.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "nodes/cloud/voxel_operations.hpp"
#include "nodes/laser_fusion/nearest_table.hpp"

namespace takt::laser_fusion {
namespace {

constexpr double kLeastStep = 1.05;
constexpr size_t kLookedAt = 500;

}  // namespace

double thin_out(const cloud::CloudView& cloud, double edge_m, cloud::VoxelGrid& grid, cloud::CloudBuffer& out) {
  const auto usable = [](const Point& p) { return cloud::usable(p); };
  const auto count = static_cast<size_t>(std::count_if(cloud.points.begin(), cloud.points.end(), usable));
  out.clear();
  if (count <= out.capacity()) {
    for (size_t i = 0; i < cloud.points.size(); ++i)
      if (usable(cloud.points[i])) out.push(cloud.points[i], cloud.coloured() ? cloud.colours[i] : Colour{});
    return 0;
  }
  for (;;) {
    grid.fill(cloud, edge_m);
    const double times_too_many = static_cast<double>(grid.voxels().size()) / static_cast<double>(out.capacity());
    if (times_too_many <= 1) break;
    edge_m *= std::max(kLeastStep, std::sqrt(times_too_many));  // voxels of a surface
  }
  cloud::reduce(grid, out);
  return edge_m;
}

double spacing_of(std::span<const Point> points) {
  if (points.size() < 2) return 0;
  const size_t stride = std::max<size_t>(1, points.size() / kLookedAt);
  std::vector<float> nearest2;
  for (size_t i = 0; i < points.size(); i += stride) {
    Nearest near;
    for (size_t j = 0; j < points.size(); ++j)
      if (j != i) near.consider(static_cast<uint32_t>(j), distance2(points[i], points[j]));
    nearest2.push_back(near.distance2);
  }
  const auto middle = nearest2.begin() + static_cast<std::ptrdiff_t>(nearest2.size() / 2);
  std::nth_element(nearest2.begin(), middle, nearest2.end());
  return std::sqrt(*middle);
}

}  // namespace takt::laser_fusion
