// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_operations.hpp"

#include <algorithm>
#include <cmath>

namespace takt::cloud {
namespace {

using Block = VoxelGrid::Block;

/// Calls visit(place in the block) for each voxel of the brick in its middle, by z, then y, then x.
template <class Visit>
void for_each_voxel(const Visit& visit) {
  for (int z = 0; z < VoxelGrid::kBrick; ++z)
    for (int y = 0; y < VoxelGrid::kBrick; ++y)
      for (int x = 0; x < VoxelGrid::kBrick; ++x) visit(VoxelIndex{x, y, z});
}

/// The taps that are not zero, as steps in a block.
struct Tap {
  int step, weight;
};
constexpr auto kTaps = [] {
  std::array<Tap, 19> taps{};
  size_t n = 0;
  for (int i = 0; i < 27; ++i)
    if (kSmoothingKernel[static_cast<size_t>(i)] != 0)
      taps[n++] = {Block::place(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1) - Block::place(0, 0, 0),
                   kSmoothingKernel[static_cast<size_t>(i)]};
  return taps;
}();

/// The k nearest points found so far, nearest first.
class Nearest {
 public:
  explicit Nearest(int k) : k_(k) {}

  void offer(double distance2, int place, const Voxel& voxel) {
    int at = size_;
    if (size_ < k_) ++size_;
    else if (!before(distance2, place, items_[--at])) return;
    for (; at > 0 && before(distance2, place, item(at - 1)); --at) item(at) = item(at - 1);
    item(at) = {distance2, place, &voxel};
  }
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
    int place;
    const Voxel* voxel;
  };
  static bool before(double distance2, int place, const Item& item) {
    return distance2 < item.distance2 || (distance2 == item.distance2 && place < item.place);
  }
  Item& item(int i) { return items_[static_cast<size_t>(i)]; }
  const Item& item(int i) const { return items_[static_cast<size_t>(i)]; }

  std::array<Item, kMostNearest> items_;
  int k_, size_ = 0;
};

int occupied_neighbours(const Block& block, const VoxelIndex& v) {
  int n = 0;
  for (int z = v.z - 1; z <= v.z + 1; ++z)
    for (int y = v.y - 1; y <= v.y + 1; ++y)
      for (int x = v.x - 1; x <= v.x + 1; ++x) n += block.at(x, y, z) != VoxelGrid::kEmpty;
  return n;
}

/// Fills gaps from a grid that holds one point a voxel.
class GapFiller {
 public:
  GapFiller(const VoxelGrid& grid, const InterpolateParameters& parameters)
      : voxels_(grid.voxels()), edge_m_(grid.edge_m()), parameters_(parameters) {}

  void fill(const Block& block, const VoxelIndex& v, CloudBuffer& out) const {
    if (block.at(v.x, v.y, v.z) != VoxelGrid::kEmpty || occupied_neighbours(block, v) < parameters_.n_adj) return;
    const double r_max = parameters_.reach * edge_m_;
    const Nearest found = nearest(block, v);
    if (!found.full() || found.farthest2() > r_max * r_max) return;
    const WeightedMean mean = found.mean();
    out.push(mean.point(), mean.colour());
  }

 private:
  // Shell by shell: a point n voxels away along any axis is at least n - 1/2 edges from the centre.
  Nearest nearest(const Block& block, const VoxelIndex& v) const {
    const VoxelIndex& o = block.origin();
    const auto centre = centre_of({o.x + v.x, o.y + v.y, o.z + v.z}, edge_m_);
    Nearest found(parameters_.k);
    const int shells = static_cast<int>(parameters_.reach + 0.5 + kRounding);
    for (int n = 1; n <= shells; ++n) {
      const double closest = (n - 0.5 - kRounding) * edge_m_;
      if (found.full() && found.farthest2() < closest * closest) break;
      for_each_of_shell(v, n, [&](int place) {
        const uint32_t index = block.at(place);
        if (index == VoxelGrid::kEmpty) return;
        const Voxel& p = voxels_[index];
        const double dx = p.x - centre[0], dy = p.y - centre[1], dz = p.z - centre[2];
        found.offer(dx * dx + dy * dy + dz * dz, place, p);
      });
    }
    return found;
  }

  template <class Visit>
  static void for_each_of_shell(const VoxelIndex& v, int n, const Visit& visit) {
    for (int z = -n; z <= n; ++z)
      for (int y = -n; y <= n; ++y) {
        const bool face = std::abs(z) == n || std::abs(y) == n;
        for (int x = -n; x <= n; x += face ? 1 : 2 * n) visit(Block::place(v.x + x, v.y + y, v.z + z));
      }
  }

  static constexpr double kRounding = 1e-6;  // of a mean that lies on the border of its voxel
  std::span<const Voxel> voxels_;
  double edge_m_;
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
    for_each_voxel([&](const VoxelIndex& v) {
      const int place = Block::place(v.x, v.y, v.z);
      WeightedMean mean;
      uint64_t number = 0;  // in units of 1/40
      for (const Tap& tap : kTaps)
        if (const uint32_t at = block.at(place + tap.step); at != VoxelGrid::kEmpty) {
          number += static_cast<uint64_t>(tap.weight) * voxels[at].points;
          mean.add(tap.weight, voxels[at]);
        }
      if (number > 0 && static_cast<double>(number) >= threshold) out.push(mean.point(), mean.colour());
    });
  });
}

void interpolate(VoxelGrid& grid, const InterpolateParameters& parameters, CloudBuffer& out) {
  grid.average();
  reduce(grid, out);
  const GapFiller filler(grid, parameters);
  grid.for_each_block(
      [&](const Block& block) { for_each_voxel([&](const VoxelIndex& v) { filler.fill(block, v, out); }); });
}

}  // namespace takt::cloud
