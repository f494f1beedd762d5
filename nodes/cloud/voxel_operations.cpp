// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_operations.hpp"

#include <algorithm>
#include <cmath>

namespace takt::cloud {
namespace {

using Block = VoxelGrid::Block;

/// Weight of the voxel at that offset.
constexpr uint32_t kernel(int x, int y, int z) {
  return static_cast<uint32_t>(kSmoothingKernel[static_cast<size_t>((z + 1) * 9 + (y + 1) * 3 + x + 1)]);
}

/// The convolved number of points of the voxels of a brick, in units of 1/40.
class Numbers {
 public:
  Numbers(const Block& block, std::span<const Voxel> voxels) {
    block.for_each_occupied({-1, -1, -1}, VoxelGrid::kBrick + 2, [&](const VoxelIndex& v, uint32_t at) {
      for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
          for (int x = -1; x <= 1; ++x) number(v.x + x, v.y + y, v.z + z) += kernel(x, y, z) * voxels[at].points;
    });
  }
  uint32_t at(int x, int y, int z) { return number(x, y, z); }

 private:
  // With the two layers around the brick that its neighbours add to as well.
  static constexpr int kSide = VoxelGrid::kBrick + 4;
  uint32_t& number(int x, int y, int z) {
    return numbers_[static_cast<size_t>(((z + 2) * kSide + y + 2) * kSide + x + 2)];
  }
  std::array<uint32_t, kSide * kSide * kSide> numbers_{};
};

/// The k nearest points found so far, nearest first.
class Nearest {
 public:
  explicit Nearest(int k) : k_(k) {}

  /// Of points at the same distance the one that was offered first is nearer.
  void offer(double distance2, const Voxel& voxel) {
    int at = size_;
    if (size_ < k_) ++size_;
    else if (distance2 >= item(--at).distance2) return;
    for (; at > 0 && distance2 < item(at - 1).distance2; --at) item(at) = item(at - 1);
    item(at) = {distance2, &voxel};
  }
  void clear() { size_ = 0; }
  bool full() const { return size_ == k_; }
  double farthest2() const { return item(size_ - 1).distance2; }
  WeightedMean mean() const {
    WeightedMean mean;
    for (int i = 0; i < k_; ++i) mean.add(1 / std::max(std::sqrt(item(i).distance2), 1e-6), *item(i).voxel);
    return mean;
  }

 private:
  struct Item {
    double distance2;
    const Voxel* voxel;
  };
  Item& item(int i) { return items_[static_cast<size_t>(i)]; }
  const Item& item(int i) const { return items_[static_cast<size_t>(i)]; }

  std::array<Item, kMostNearest> items_;
  int k_, size_ = 0;
};

/// Fills gaps from a grid that holds one point a voxel.
class GapFiller {
 public:
  GapFiller(const VoxelGrid& grid, const InterpolateParameters& parameters)
      : voxels_(grid.voxels()), size_(grid.size()), parameters_(parameters) {}

  void fill(const Block& block, const VoxelIndex& v, CloudBuffer& out) const {
    if (block.occupied_around(v) < parameters_.n_adj) return;
    const double r_max = parameters_.reach * size_.edge_m();
    Nearest found(parameters_.k);
    find_nearest(block, v, found);
    if (!found.full() || found.farthest2() > r_max * r_max) return;
    const WeightedMean mean = found.mean();
    out.push(mean.point(), mean.colour());
  }

 private:
  // In the smallest cube of voxels that suffices: what lies outside one of half width n is n + 1/2 edges away or more.
  void find_nearest(const Block& block, const VoxelIndex& v, Nearest& found) const {
    const VoxelIndex& o = block.origin();
    const auto centre = size_.centre_of({o.x + v.x, o.y + v.y, o.z + v.z});
    const int largest = static_cast<int>(parameters_.reach + 0.5 + kRounding);
    for (int n = 1;; ++n) {
      found.clear();
      block.for_each_around(v, n, [&](const VoxelIndex&, uint32_t index) {
        const Voxel& p = voxels_[index];
        const double dx = p.x - centre[0], dy = p.y - centre[1], dz = p.z - centre[2];
        found.offer(dx * dx + dy * dy + dz * dz, p);
      });
      const double outside = (n + 0.5 - kRounding) * size_.edge_m();
      if (n >= largest || (found.full() && found.farthest2() < outside * outside)) return;
    }
  }

  static constexpr double kRounding = 1e-6;  // of a mean that lies on the border of its voxel
  std::span<const Voxel> voxels_;
  VoxelSize size_;
  const InterpolateParameters& parameters_;
};

}  // namespace

void reduce(const VoxelGrid& grid, CloudBuffer& out) {
  for (const Voxel& v : grid.voxels()) out.push(v.mean(), v.mean_colour());
}

void smooth(VoxelGrid& grid, double t_occ, CloudBuffer& out) {
  const std::span<const Voxel> voxels = grid.voxels();
  const double threshold = t_occ * kKernelSum;
  grid.for_each_block([&](const Block& block) {
    Numbers numbers(block, voxels);
    for (int z = 0; z < VoxelGrid::kBrick; ++z)
      for (int y = 0; y < VoxelGrid::kBrick; ++y)
        for (int x = 0; x < VoxelGrid::kBrick; ++x) {
          const uint32_t number = numbers.at(x, y, z);
          if (number == 0 || number < threshold) continue;
          WeightedMean mean;
          block.for_each_around({x, y, z}, 1, [&](const VoxelIndex& v, uint32_t at) {
            mean.add(kernel(v.x - x, v.y - y, v.z - z), voxels[at]);
          });
          out.push(mean.point(), mean.colour());
        }
  });
}

void interpolate(VoxelGrid& grid, const InterpolateParameters& parameters, CloudBuffer& out) {
  grid.average();
  reduce(grid, out);
  const GapFiller filler(grid, parameters);
  grid.for_each_block(
      [&](const Block& block) { block.for_each_gap([&](const VoxelIndex& v) { filler.fill(block, v, out); }); });
}

}  // namespace takt::cloud
