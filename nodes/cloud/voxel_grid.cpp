// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_grid.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include "nodes/cloud/count_kernel.hpp"

namespace takt::cloud {
namespace {

constexpr size_t kMostPoints = size_t{1} << 24;  // their colours add up in 32 bits
constexpr int kKeyBits = 21;
constexpr int32_t kMiddle = 1 << (kKeyBits - 1);
constexpr double kFarthestVoxel = 4e6;
static_assert(kFarthestVoxel / VoxelGrid::kBrick + 3 < kMiddle);  // a step of two bricks never carries between axes

constexpr uint64_t step(int x, int y, int z) {
  return static_cast<uint64_t>(x) + (static_cast<uint64_t>(y) << kKeyBits) + (static_cast<uint64_t>(z) << 2 * kKeyBits);
}

uint64_t key_of(const VoxelIndex& v) { return step((v.x >> 2) + kMiddle, (v.y >> 2) + kMiddle, (v.z >> 2) + kMiddle); }

constexpr uint32_t axis_of(uint64_t key, int axis) {
  return static_cast<uint32_t>(key >> axis * kKeyBits) & ((1u << kKeyBits) - 1);
}

VoxelIndex first_voxel_of(uint64_t key) {
  const auto coordinate = [&](int axis) {
    return (static_cast<int32_t>(axis_of(key, axis)) - kMiddle) * VoxelGrid::kBrick;
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

uint32_t bit_of(const VoxelIndex& v) { return static_cast<uint32_t>((v.x & 3) | (v.y & 3) << 2 | (v.z & 3) << 4); }

struct Direction {
  int x, y, z;
};

/// The 26 neighbours of a brick, in the order of z, y, x; the opposite of d is 25 - d.
constexpr auto kNeighbours = [] {
  std::array<Direction, 26> all{};
  size_t n = 0;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (x != 0 || y != 0 || z != 0) all[n++] = {x, y, z};
  return all;
}();

/// Which voxels of a brick touch its neighbour in a direction.
constexpr auto kFacing = [] {
  std::array<uint64_t, 26> all{};
  const auto touches = [](int at, int direction) { return direction == 0 || at == (direction < 0 ? 0 : 3); };
  for (size_t d = 0; d < all.size(); ++d)
    for (int bit = 0; bit < 64; ++bit)
      if (touches(bit & 3, kNeighbours[d].x) && touches(bit >> 2 & 3, kNeighbours[d].y) &&
          touches(bit >> 4, kNeighbours[d].z))
        all[d] |= uint64_t{1} << bit;
  return all;
}();

uint8_t rounded(double sum, double weight) { return static_cast<uint8_t>(sum / weight + 0.5); }

}  // namespace

const std::array<VoxelGrid::Key, VoxelGrid::kDirections> VoxelGrid::kSteps = [] {
  std::array<Key, kDirections> steps{};
  for (size_t d = 0; d < kDirections; ++d) steps[d] = step(kNeighbours[d].x, kNeighbours[d].y, kNeighbours[d].z);
  return steps;
}();

void Voxel::add(const Point& point, const Colour& colour) {
  x += static_cast<double>(point.x);
  y += static_cast<double>(point.y);
  z += static_cast<double>(point.z);
  b += colour.b;
  g += colour.g;
  r += colour.r;
  ++points;
}

Point Voxel::mean() const {
  return {static_cast<float>(x / points), static_cast<float>(y / points), static_cast<float>(z / points)};
}

Colour Voxel::mean_colour() const { return {rounded(b, points), rounded(g, points), rounded(r, points)}; }

void WeightedMean::add(double weight, const Voxel& voxel) {
  weight_ += weight * voxel.points;
  x_ += weight * voxel.x;
  y_ += weight * voxel.y;
  z_ += weight * voxel.z;
  b_ += weight * voxel.b;
  g_ += weight * voxel.g;
  r_ += weight * voxel.r;
}

Point WeightedMean::point() const {
  return {static_cast<float>(x_ / weight_), static_cast<float>(y_ / weight_), static_cast<float>(z_ / weight_)};
}

Colour WeightedMean::colour() const { return {rounded(b_, weight_), rounded(g_, weight_), rounded(r_, weight_)}; }

VoxelSize::VoxelSize(double edge_m)
    : edge_m_(edge_m),
      per_m_(1 / edge_m),
      farthest_m_(static_cast<float>(std::min(static_cast<double>(kFarthest_m), kFarthestVoxel * edge_m))) {}

VoxelGrid::VoxelGrid(size_t capacity) : cells_(capacity), bricks_(capacity), voxels_(capacity) {
  if (capacity > kMostPoints) throw std::invalid_argument("a voxel grid holds at most 2^24 points");
}

void VoxelGrid::fill(const CloudView& cloud, double edge_m) {
  size_ = VoxelSize(edge_m);
  const size_t count = std::min(cloud.points.size(), capacity());
  lost_ = cloud.points.size() - count;
  brick_count_ = voxel_count_ = 0;
  sort(cloud.points.first(count));
  const auto start = cells_.start();
  uint32_t first_point = 0;
  for (uint32_t bucket = 0; bucket < layout_.buckets; ++bucket) {
    const uint32_t last_point = start[bucket + 1];
    start[bucket] = brick_count_;
    if (first_point == last_point) continue;
    const std::span points(cells_.points() + first_point, last_point - first_point);
    add_bricks(points);
    add_voxels(points, start[bucket], cloud);
    first_point = last_point;
  }
  start[layout_.buckets] = brick_count_;
}

void VoxelGrid::sort(std::span<const Point> points) {
  const Bounds bounds = bounds_of(points, size_.farthest_m());
  unusable_ = points.size() - bounds.points;
  const Point low{bounds.low[0], bounds.low[1], bounds.low[2]}, high{bounds.high[0], bounds.high[1], bounds.high[2]};
  const Key first = bounds.points > 0 ? key_of(size_.voxel_of(low)) : 0,
            last = bounds.points > 0 ? key_of(size_.voxel_of(high)) : 0;
  // Two empty bricks on each side: what is asked for there lies in the layout.
  constexpr uint32_t kBorder = 2;
  double cells[3];
  for (int a = 0; a < 3; ++a) cells[a] = axis_of(last, a) - axis_of(first, a) + 1 + 2 * kBorder;
  layout_ = cells_.layout(cells, points.size());
  first_bucket_ = (kBorder - axis_of(first, 0)) + (kBorder - axis_of(first, 1)) * layout_.row +
                  (kBorder - axis_of(first, 2)) * layout_.layer;
  for (size_t d = 0; d < kDirections; ++d)
    bucket_steps_[d] = static_cast<uint32_t>(kNeighbours[d].x) + static_cast<uint32_t>(kNeighbours[d].y) * layout_.row +
                       static_cast<uint32_t>(kNeighbours[d].z) * layout_.layer;
  cells_.sort(points, layout_, [this](const Point& p) {
    return size_.holds(p) ? bucket_of(key_of(size_.voxel_of(p))) : layout_.buckets;
  });
}

/// The bricks of the points of one bucket.
void VoxelGrid::add_bricks(std::span<const SortedPoint> points) {
  const uint32_t first_brick = brick_count_;
  for (const SortedPoint& p : points) {
    const VoxelIndex voxel = size_.voxel_of({p.x, p.y, p.z});
    uint32_t brick = find(key_of(voxel), first_brick, brick_count_);
    if (brick == kNone) bricks_[brick = brick_count_++] = {key_of(voxel), 0, 0};
    bricks_[brick].occupied |= uint64_t{1} << bit_of(voxel);
  }
  // Bricks that share a bucket must not be in the order of the points.
  const auto added = std::span(bricks_).subspan(first_brick, brick_count_ - first_brick);
  if (added.size() > 1)
    std::sort(added.begin(), added.end(), [](const Brick& a, const Brick& b) { return a.key < b.key; });
  for (Brick& brick : added) {
    brick.first_voxel = voxel_count_;
    voxel_count_ += static_cast<uint32_t>(std::popcount(brick.occupied));
  }
}

/// The voxels of the points of one bucket, whose bricks are there.
void VoxelGrid::add_voxels(std::span<const SortedPoint> points, uint32_t first_brick, const CloudView& cloud) {
  std::fill(voxels_.begin() + bricks_[first_brick].first_voxel, voxels_.begin() + voxel_count_, Voxel{});
  for (const SortedPoint& p : points) {
    const VoxelIndex voxel = size_.voxel_of({p.x, p.y, p.z});
    const Brick& brick = bricks_[find(key_of(voxel), first_brick, brick_count_)];
    const uint64_t before = (uint64_t{1} << bit_of(voxel)) - 1;
    voxels_[brick.first_voxel + static_cast<uint32_t>(std::popcount(brick.occupied & before))].add(
        {p.x, p.y, p.z}, cloud.coloured() ? cloud.colours[p.index] : Colour{});
  }
}

uint32_t VoxelGrid::bucket_of(Key key) const {
  return layout_.wrapped(first_bucket_ + layout_.bucket(axis_of(key, 0), axis_of(key, 1), axis_of(key, 2)));
}

uint32_t VoxelGrid::find(Key key, uint32_t first_brick, uint32_t last_brick) const {
  for (uint32_t b = first_brick; b < last_brick; ++b)
    if (bricks_[b].key == key) return b;
  return kNone;
}

/// The neighbour of the brick, which is there or not, of that key and bucket.
uint32_t VoxelGrid::find_neighbour(Key key, uint32_t bucket, size_t direction) const {
  const uint32_t there = layout_.wrapped(bucket + bucket_steps_[direction]);
  return find(key + kSteps[direction], cells_.start()[there], cells_.start()[there + 1]);
}

void VoxelGrid::average() {
  for (Voxel& v : std::span(voxels_).first(voxel_count_)) {
    const Colour colour = v.mean_colour();
    v = {v.x / v.points, v.y / v.points, v.z / v.points, colour.b, colour.g, colour.r, 1};
  }
}

// The empty neighbours of a brick that its points touch; the brick is loaded.
uint32_t VoxelGrid::empty_reached(uint32_t brick) const {
  uint32_t reached = 0;
  for (size_t d = 0; d < kDirections; ++d)
    if ((bricks_[brick].occupied & kFacing[d]) != 0) reached |= 1u << d;
  return reached & block_.empty_neighbours_;
}

// Of the bricks whose points touch an empty one, the first in the order of directions: so each is visited once.
uint32_t VoxelGrid::first_to_reach(Key key) const {
  const uint32_t bucket = bucket_of(key);
  for (size_t d = 0; d < kDirections; ++d) {
    const uint32_t brick = find_neighbour(key, bucket, d);
    if (brick != kNone && (bricks_[brick].occupied & kFacing[kDirections - 1 - d]) != 0) return brick;
  }
  return kNone;
}

void VoxelGrid::load(Key key) {
  block_.origin_ = first_voxel_of(key);
  block_.rows_.fill(0);
  block_.empty_neighbours_ = 0;
  const uint32_t bucket = bucket_of(key);
  if (const uint32_t own = find(key, cells_.start()[bucket], cells_.start()[bucket + 1]); own != kNone)
    load_brick(bricks_[own], 0, 0, 0);
  for (size_t d = 0; d < kDirections; ++d) {
    const uint32_t brick = find_neighbour(key, bucket, d);
    if (brick == kNone) block_.empty_neighbours_ |= 1u << d;
    else load_brick(bricks_[brick], kNeighbours[d].x, kNeighbours[d].y, kNeighbours[d].z);
  }
}

/// So many bricks away from the middle of the block.
void VoxelGrid::load_brick(const Brick& brick, int x, int y, int z) {
  uint32_t voxel = brick.first_voxel;
  for (uint64_t rest = brick.occupied; rest != 0; rest &= rest - 1) {
    const int bit = std::countr_zero(rest);
    const VoxelIndex v{x * kBrick + (bit & 3), y * kBrick + (bit >> 2 & 3), z * kBrick + (bit >> 4)};
    uint16_t& row = block_.rows_[Block::row(v.y, v.z)];
    row = static_cast<uint16_t>(row | 1 << (v.x + kBrick));
    block_.voxels_[Block::place(v.x, v.y, v.z)] = voxel++;
  }
}

}  // namespace takt::cloud
