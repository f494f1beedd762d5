// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_grid.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

namespace takt::cloud {
namespace {

constexpr uint32_t kBitsOfVoxel = 6;             // 64 voxels a brick
constexpr size_t kMostPoints = size_t{1} << 24;  // their colours add up in 32 bits
// A key holds the brick's three coordinates in 21 bits each, moved up so that none is negative and a step of two bricks
// never carries from one into the next.
constexpr int kKeyBits = 21;
constexpr int32_t kMiddle = 1 << (kKeyBits - 1);
constexpr double kFarthestVoxel = 4e6;
static_assert(kFarthestVoxel / VoxelGrid::kBrick + 3 < kMiddle);

constexpr uint64_t step(int x, int y, int z) {
  return static_cast<uint64_t>(x) + (static_cast<uint64_t>(y) << kKeyBits) + (static_cast<uint64_t>(z) << 2 * kKeyBits);
}

uint64_t key_of(const VoxelIndex& v) { return step((v.x >> 2) + kMiddle, (v.y >> 2) + kMiddle, (v.z >> 2) + kMiddle); }

VoxelIndex first_voxel_of(uint64_t key) {
  const auto coordinate = [&](int shift) {
    return (static_cast<int32_t>(key >> shift & ((1u << kKeyBits) - 1)) - kMiddle) * VoxelGrid::kBrick;
  };
  return {coordinate(0), coordinate(kKeyBits), coordinate(2 * kKeyBits)};
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

const std::array<uint64_t, VoxelGrid::kDirections> VoxelGrid::kSteps = [] {
  std::array<uint64_t, kDirections> steps{};
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

std::optional<VoxelIndex> voxel_of(const Point& point, double edge_m) {
  const double x = static_cast<double>(point.x) / edge_m, y = static_cast<double>(point.y) / edge_m,
               z = static_cast<double>(point.z) / edge_m;
  // Written so that NaN fails.
  if (!(std::abs(x) < kFarthestVoxel && std::abs(y) < kFarthestVoxel && std::abs(z) < kFarthestVoxel))
    return std::nullopt;
  const auto whole = [](double v) {  // rounded down; std::floor is a call on old targets
    const auto towards_zero = static_cast<int32_t>(v);
    return towards_zero - (v < towards_zero ? 1 : 0);
  };
  return VoxelIndex{whole(x), whole(y), whole(z)};
}

std::array<double, 3> centre_of(const VoxelIndex& voxel, double edge_m) {
  return {(voxel.x + 0.5) * edge_m, (voxel.y + 0.5) * edge_m, (voxel.z + 0.5) * edge_m};
}

VoxelGrid::VoxelGrid(size_t capacity)
    : brick_of_(capacity), table_(std::bit_ceil(2 * capacity + 2)), bricks_(capacity), voxels_(capacity) {
  if (capacity > kMostPoints) throw std::invalid_argument("a voxel grid holds at most 2^24 points");
}

uint32_t VoxelGrid::find(uint64_t key) const {
  const size_t mask = (size_t{1} << (64 - shift_)) - 1;
  for (size_t at = key * 0x9E3779B97F4A7C15u >> shift_;; at = (at + 1) & mask)
    if (table_[at] == kEmpty || bricks_[table_[at]].key == key) return table_[at];
}

uint32_t VoxelGrid::find_or_add(uint64_t key) {
  const size_t mask = (size_t{1} << (64 - shift_)) - 1;
  size_t at = key * 0x9E3779B97F4A7C15u >> shift_;
  for (; table_[at] != kEmpty; at = (at + 1) & mask)
    if (bricks_[table_[at]].key == key) return table_[at];
  bricks_[brick_count_] = {key, 0, 0};
  return table_[at] = brick_count_++;
}

void VoxelGrid::fill(const CloudView& cloud, double edge_m) {
  edge_m_ = edge_m;
  const size_t count = std::min(cloud.points.size(), capacity());
  lost_ = cloud.points.size() - count;
  unusable_ = 0;
  brick_count_ = voxel_count_ = 0;
  const size_t table = std::bit_ceil(2 * count + 2);
  shift_ = 64 - std::countr_zero(table);
  std::fill_n(table_.begin(), table, kEmpty);

  uint64_t last_key = 0;  // no brick has it
  uint32_t brick = 0;
  for (size_t i = 0; i < count; ++i) {
    const auto voxel = voxel_of(cloud.points[i], edge_m);
    brick_of_[i] = kEmpty;
    if (!voxel) {
      ++unusable_;
      continue;
    }
    if (const uint64_t key = key_of(*voxel); key != last_key) {  // neighbours in the cloud are neighbours in space
      brick = find_or_add(key);
      last_key = key;
    }
    const uint32_t bit = bit_of(*voxel);
    bricks_[brick].occupied |= uint64_t{1} << bit;
    brick_of_[i] = brick << kBitsOfVoxel | bit;
  }
  for (uint32_t b = 0; b < brick_count_; ++b) {
    bricks_[b].first_voxel = voxel_count_;
    voxel_count_ += static_cast<uint32_t>(std::popcount(bricks_[b].occupied));
  }
  std::fill_n(voxels_.begin(), voxel_count_, Voxel{});
  for (size_t i = 0; i < count; ++i) {
    if (brick_of_[i] == kEmpty) continue;
    const Brick& b = bricks_[brick_of_[i] >> kBitsOfVoxel];
    const uint64_t before = (uint64_t{1} << (brick_of_[i] & 63)) - 1;
    voxels_[b.first_voxel + static_cast<uint32_t>(std::popcount(b.occupied & before))].add(
        cloud.points[i], cloud.coloured() ? cloud.colours[i] : Colour{});
  }
}

void VoxelGrid::average() {
  for (Voxel& v : std::span(voxels_).first(voxel_count_)) {
    const Colour colour = v.mean_colour();
    v = {v.x / v.points, v.y / v.points, v.z / v.points, colour.b, colour.g, colour.r, 1};
  }
}

// True if the brick's points touch an empty brick in that direction, and no brick in an earlier direction from there
// does as well: so each empty brick is visited once.
bool VoxelGrid::reaches_empty(uint32_t brick, size_t direction) const {
  if ((bricks_[brick].occupied & kFacing[direction]) == 0) return false;
  const uint64_t key = bricks_[brick].key + kSteps[direction];
  if (find(key) != kEmpty) return false;
  for (size_t d = 0; d < kDirections; ++d) {
    const uint32_t other = find(key + kSteps[d]);
    if (other != kEmpty && (bricks_[other].occupied & kFacing[kDirections - 1 - d]) != 0) return other == brick;
  }
  return false;
}

void VoxelGrid::load(uint64_t key) {
  block_.origin_ = first_voxel_of(key);
  block_.voxels_.fill(kEmpty);
  const auto load_brick = [&](uint64_t at, const Direction& d) {
    const uint32_t found = find(at);
    if (found == kEmpty) return;
    uint32_t voxel = bricks_[found].first_voxel;
    for (uint64_t rest = bricks_[found].occupied; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      block_.voxels_[static_cast<size_t>(
          Block::place(d.x * kBrick + (bit & 3), d.y * kBrick + (bit >> 2 & 3), d.z * kBrick + (bit >> 4)))] = voxel++;
    }
  };
  load_brick(key, {0, 0, 0});
  for (size_t d = 0; d < kDirections; ++d) load_brick(key + kSteps[d], kNeighbours[d]);
}

}  // namespace takt::cloud
