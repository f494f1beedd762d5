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

void Thinning::begin(const cloud::CloudView& cloud, double edge_m, const cloud::CloudBuffer& out) {
  cloud_ = cloud;
  edge_m_ = edge_m;
  out_ = out;
  out_.clear();
  counted_ = false;
}

bool Thinning::go_on(cloud::VoxelGrid& grid) {
  if (!counted_) {
    counted_ = true;
    const auto usable = [](const Point& p) { return cloud::usable(p); };
    const auto count = static_cast<size_t>(std::count_if(cloud_.points.begin(), cloud_.points.end(), usable));
    if (count > out_.capacity()) return false;
    edge_m_ = 0;
    for (size_t i = 0; i < cloud_.points.size(); ++i)
      if (usable(cloud_.points[i])) out_.push(cloud_.points[i], cloud_.coloured() ? cloud_.colours[i] : Colour{});
    return true;
  }
  grid.fill(cloud_, edge_m_);
  const double times_too_many = static_cast<double>(grid.voxels().size()) / static_cast<double>(out_.capacity());
  if (times_too_many > 1) {
    edge_m_ *= std::max(kLeastStep, std::sqrt(times_too_many));  // voxels of a surface
    return false;
  }
  cloud::reduce(grid, out_);
  return true;
}

double thin_out(const cloud::CloudView& cloud, double edge_m, cloud::VoxelGrid& grid, cloud::CloudBuffer& out) {
  Thinning thinning;
  thinning.begin(cloud, edge_m, out);
  while (!thinning.go_on(grid)) {
  }
  out.shorten(thinning.size());
  return thinning.edge_m();
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
