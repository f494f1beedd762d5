// SPDX-License-Identifier: Apache-2.0
// A cloud sorted into voxels. Voxels stand in bricks of 4 x 4 x 4: what surrounds a voxel is then 27 look-ups for 64
// voxels.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "nodes/cloud/cell_sort.hpp"
#include "rt/msg/point.hpp"

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

/// How space is divided.
class VoxelSize {
 public:
  /// Above 0, m.
  explicit VoxelSize(double edge_m);
  double edge_m() const { return edge_m_; }
  /// False for points that are not usable() or farther from the origin than 4 million edges along an axis.
  bool holds(const Point& point) const { return usable(point, farthest_m_); }
  float farthest_m() const { return farthest_m_; }
  /// Of a point that it holds.
  VoxelIndex voxel_of(const Point& point) const { return {whole(point.x), whole(point.y), whole(point.z)}; }
  /// Middle of a voxel, m.
  std::array<double, 3> centre_of(const VoxelIndex& voxel) const {
    return {(voxel.x + 0.5) * edge_m_, (voxel.y + 0.5) * edge_m_, (voxel.z + 0.5) * edge_m_};
  }

 private:
  int32_t whole(float v) const {  // rounded down; std::floor is a call on old targets
    const double scaled = static_cast<double>(v) * per_m_;
    const auto towards_zero = static_cast<int32_t>(scaled);
    return towards_zero - (scaled < towards_zero ? 1 : 0);
  }
  double edge_m_, per_m_;
  float farthest_m_;
};

class VoxelGrid {
 public:
  static constexpr int kBrick = 4;  ///< edge of a brick, voxels

  /// A brick and its 26 neighbours. Coordinates count from the brick's first voxel: -4 .. 7, the brick's own are 0
  /// .. 3.
  class Block {
   public:
    /// Calls visit(voxel, index in voxels()) for the occupied voxels of the cube of that size whose first voxel is
    /// `first`, by z, then y, then x. The cube lies within the block.
    template <class Visit>
    void for_each_occupied(const VoxelIndex& first, int size, const Visit& visit) const {
      const uint32_t window = (1u << size) - 1;
      for (int z = first.z; z < first.z + size; ++z)
        for (int y = first.y; y < first.y + size; ++y)
          for (uint32_t rest = rows_[row(y, z)] >> (first.x + kBrick) & window; rest != 0; rest &= rest - 1) {
            const int x = first.x + std::countr_zero(rest);
            visit(VoxelIndex{x, y, z}, voxels_[place(x, y, z)]);
          }
    }
    /// The same for the cube of that half width around a voxel.
    template <class Visit>
    void for_each_around(const VoxelIndex& v, int half_width, const Visit& visit) const {
      for_each_occupied({v.x - half_width, v.y - half_width, v.z - half_width}, 2 * half_width + 1, visit);
    }
    /// How many of the 26 neighbours of a voxel, and itself, are occupied. It lies within the brick.
    int occupied_around(const VoxelIndex& v) const {
      constexpr uint64_t kBitsSet = 0x3221'2110;  // of 0 .. 7, a digit each
      uint64_t n = 0;
      for (int z = v.z - 1; z <= v.z + 1; ++z)
        for (int y = v.y - 1; y <= v.y + 1; ++y) n += kBitsSet >> 4 * (rows_[row(y, z)] >> (v.x + kBrick - 1) & 7) & 15;
      return static_cast<int>(n);
    }
    /// Calls visit(voxel) for the empty voxels of the brick that are next to an occupied one, by z, then y, then x.
    template <class Visit>
    void for_each_gap(const Visit& visit) const {
      for (int z = 0; z < kBrick; ++z)
        for (int y = 0; y < kBrick; ++y) {
          uint32_t near = 0;
          for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy) near |= rows_[row(y + dy, z + dz)];
          near = (near | near << 1 | near >> 1) & ~uint32_t{rows_[row(y, z)]};
          for (uint32_t rest = near >> kBrick & 15; rest != 0; rest &= rest - 1)
            visit(VoxelIndex{std::countr_zero(rest), y, z});
        }
    }
    /// Where voxel (0, 0, 0) lies in the grid.
    const VoxelIndex& origin() const { return origin_; }

   private:
    friend class VoxelGrid;
    static constexpr int kSide = 3 * kBrick;
    static constexpr size_t row(int y, int z) { return static_cast<size_t>((z + kBrick) * kSide + y + kBrick); }
    static constexpr size_t place(int x, int y, int z) { return row(y, z) * kSide + static_cast<size_t>(x + kBrick); }

    std::array<uint16_t, kSide * kSide> rows_;            ///< bit x + 4: that voxel of the row is occupied
    std::array<uint32_t, kSide * kSide * kSide> voxels_;  ///< index in voxels(), where it is
    uint32_t empty_neighbours_ = 0;                       ///< bit d: the brick in that direction holds no point
    VoxelIndex origin_;
  };

  /// Takes the memory for clouds of up to `capacity` points (about 100 B a point); nothing else allocates. Throws
  /// std::invalid_argument if that is above 2^24.
  explicit VoxelGrid(size_t capacity);

  /// Sorts a cloud into voxels of that edge (m, above 0). Points without a place, and those beyond the capacity, are
  /// left out and counted.
  void fill(const CloudView& cloud, double edge_m);
  /// Each voxel from now on holds one point: the mean of those it held.
  void average();

  const VoxelSize& size() const { return size_; }
  size_t capacity() const { return cells_.capacity(); }
  size_t unusable() const { return unusable_; }  ///< points of the last cloud that had no place
  size_t lost() const { return lost_; }          ///< points of the last cloud that were beyond the capacity
  /// Brick after brick, within a brick by z, then y, then x. Of a scene that is not vast the bricks stand in that
  /// order, too; in any case the order does not depend on that of the points.
  std::span<const Voxel> voxels() const { return std::span(voxels_).first(voxel_count_); }

  /// Calls visit(const Block&) once for each brick that holds a point, or touches a voxel that does: so for each voxel
  /// that is occupied or next to an occupied one. In the order of the bricks, each followed by its empty neighbours.
  template <class Visit>
  void for_each_block(Visit&& visit) {
    for (uint32_t b = 0; b < brick_count_; ++b) {
      load(bricks_[b].key);
      visit(std::as_const(block_));
      for (uint32_t rest = empty_reached(b); rest != 0; rest &= rest - 1) {
        const Key key = bricks_[b].key + kSteps[static_cast<size_t>(std::countr_zero(rest))];
        if (first_to_reach(key) != b) continue;
        load(key);
        visit(std::as_const(block_));
      }
    }
  }

 private:
  /// Of a brick in 21 bits for each axis, moved up so that none is negative: keys of neighbours differ by a constant.
  using Key = uint64_t;
  struct Brick {
    Key key = 0;
    uint64_t occupied = 0;     ///< bit x + 4 y + 16 z of each voxel that holds a point
    uint32_t first_voxel = 0;  ///< of voxels_; those of a brick follow one another in the order of the bits
  };
  static constexpr size_t kDirections = 26;
  static constexpr uint32_t kNone = UINT32_MAX;
  static const std::array<Key, kDirections> kSteps;  ///< from the key of a brick to those of its neighbours

  void sort(std::span<const Point> points);
  void add_bricks(std::span<const SortedPoint> points);
  void add_voxels(std::span<const SortedPoint> points, uint32_t first_brick, const CloudView& cloud);
  uint32_t bucket_of(Key key) const;
  uint32_t find(Key key, uint32_t first_brick, uint32_t last_brick) const;
  uint32_t find_neighbour(Key key, uint32_t bucket, size_t direction) const;
  uint32_t empty_reached(uint32_t brick) const;
  uint32_t first_to_reach(Key key) const;
  void load(Key key);
  void load_brick(const Brick& brick, int x, int y, int z);

  VoxelSize size_{1};
  size_t unusable_ = 0, lost_ = 0;
  uint32_t brick_count_ = 0, voxel_count_ = 0;
  CellSort cells_;  ///< once a cloud is filled in, start() counts bricks instead of points
  CellLayout layout_;
  uint32_t first_bucket_ = 0;  ///< what the layout would say of key 0
  std::array<uint32_t, kDirections> bucket_steps_{};
  std::vector<Brick> bricks_;  ///< by bucket
  std::vector<Voxel> voxels_;
  Block block_;
};

}  // namespace takt::cloud
