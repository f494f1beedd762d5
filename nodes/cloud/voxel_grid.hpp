// SPDX-License-Identifier: Apache-2.0
// A cloud sorted into voxels. Voxels stand in bricks of 4 x 4 x 4, found by hashing: what surrounds a voxel is then 27
// look-ups for 64 voxels, and an empty region of any size costs nothing.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "nodes/cloud/cloud.hpp"

namespace takt::cloud {

/// The points of one voxel, summed up in the order of the cloud.
struct Voxel {
  double x = 0, y = 0, z = 0;  ///< sums, m
  uint32_t b = 0, g = 0, r = 0;
  uint32_t points = 0;

  void add(const Point& point, const Colour& colour);
  Point mean() const;
  Colour mean_colour() const;  ///< rounded half up
};

/// Mean of voxels with weights; every operation and its reference add in the same order, so they round alike.
class WeightedMean {
 public:
  void add(double weight, const Voxel& voxel);
  Point point() const;
  Colour colour() const;  ///< rounded half up

 private:
  double weight_ = 0, x_ = 0, y_ = 0, z_ = 0, b_ = 0, g_ = 0, r_ = 0;
};

/// Voxel (i, j, k) holds what lies in [i, i + 1) x [j, j + 1) x [k, k + 1) edges: the origin is a corner.
struct VoxelIndex {
  int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const VoxelIndex&) const = default;
};

/// Nothing if the point is not finite or 4 million voxels or more from the origin.
std::optional<VoxelIndex> voxel_of(const Point& point, double edge_m);

/// Middle of a voxel, m.
std::array<double, 3> centre_of(const VoxelIndex& voxel, double edge_m);

class VoxelGrid {
 public:
  static constexpr int kBrick = 4;                ///< edge of a brick, voxels
  static constexpr uint32_t kEmpty = UINT32_MAX;  ///< a voxel without points

  /// A brick and its neighbours: every voxel within four of those in the middle.
  class Block {
   public:
    static constexpr int kSide = 3 * kBrick;
    /// Which of voxels() that is, or kEmpty. (0, 0, 0) is the brick's first voxel; coordinates -4 .. 7.
    uint32_t at(int x, int y, int z) const { return at(place(x, y, z)); }
    uint32_t at(int place) const { return voxels_[static_cast<size_t>(place)]; }
    /// Places grow with z, then y, then x; a step in y is kSide, one in z kSide^2.
    static constexpr int place(int x, int y, int z) { return ((z + kBrick) * kSide + y + kBrick) * kSide + x + kBrick; }
    /// Where voxel (0, 0, 0) lies in the grid.
    const VoxelIndex& origin() const { return origin_; }

   private:
    friend class VoxelGrid;
    std::array<uint32_t, kSide * kSide * kSide> voxels_;
    VoxelIndex origin_;
  };

  /// Takes the memory for clouds of up to `capacity` points (about 85 B a point); nothing else allocates. Throws
  /// std::invalid_argument if that is above 2^24.
  explicit VoxelGrid(size_t capacity);

  /// Sorts a cloud into voxels of that edge (m, above 0). Points without a place, and those beyond the capacity, are
  /// left out and counted.
  void fill(const CloudView& cloud, double edge_m);
  /// Each voxel from now on holds one point: the mean of those it held.
  void average();

  double edge_m() const { return edge_m_; }
  size_t capacity() const { return brick_of_.size(); }
  size_t unusable() const { return unusable_; }  ///< points of the last cloud that had no place
  size_t lost() const { return lost_; }          ///< points of the last cloud that were beyond the capacity
  /// Brick after brick in the order of their first points; within a brick by z, then y, then x.
  std::span<const Voxel> voxels() const { return std::span(voxels_).first(voxel_count_); }

  /// Calls visit(const Block&) once for each brick that holds a point, or touches a voxel that does: so for each voxel
  /// that is occupied or next to an occupied one. In the order of the bricks, each followed by its empty neighbours.
  template <class Visit>
  void for_each_block(Visit&& visit) {
    for (uint32_t b = 0; b < brick_count_; ++b) {
      load(bricks_[b].key);
      visit(std::as_const(block_));
      for (size_t d = 0; d < kDirections; ++d) {
        if (!reaches_empty(b, d)) continue;
        load(bricks_[b].key + kSteps[d]);
        visit(std::as_const(block_));
      }
    }
  }

 private:
  struct Brick {
    uint64_t key = 0;
    uint64_t occupied = 0;     ///< bit x + 4 y + 16 z of each voxel that holds a point
    uint32_t first_voxel = 0;  ///< of voxels_; those of a brick follow one another in the order of the bits
  };
  static constexpr size_t kDirections = 26;
  static const std::array<uint64_t, kDirections> kSteps;

  uint32_t find(uint64_t key) const;
  uint32_t find_or_add(uint64_t key);
  bool reaches_empty(uint32_t brick, size_t direction) const;
  void load(uint64_t key);

  double edge_m_ = 1;
  size_t unusable_ = 0, lost_ = 0;
  uint32_t brick_count_ = 0, voxel_count_ = 0;
  std::vector<uint32_t> brick_of_;  ///< of each point: brick times 64 + bit
  std::vector<uint32_t> table_;     ///< open addressing: bricks by the hash of their keys
  int shift_ = 0;                   ///< a hash is the upper 64 - shift_ bits of a product
  std::vector<Brick> bricks_;
  std::vector<Voxel> voxels_;
  Block block_;
};

}  // namespace takt::cloud
