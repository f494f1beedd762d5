// SPDX-License-Identifier: Apache-2.0
// From one seed to the points of its object (thesis Alg. 3.2, indices repaired, E-07; ): what
// hangs together point by point and lies within reach of the seed.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/cloud/cell_sort.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

/// A vertical cylinder around a seed; z is up.
struct Reach {
  float radius_m = 1.0f, up_m = 0.35f, down_m = 2.0f;

  bool holds(const Point& seed, float x, float y, float z) const {
    const float dx = x - seed.x, dy = y - seed.y;
    return dx * dx + dy * dy <= radius_m * radius_m && z <= seed.z + up_m && z >= seed.z - down_m;
  }
};

struct GrowParameters {
  float d_max_m = 0.08f;   ///< two points at most so far apart hang together; above 0
  float colour_max = 0;    ///< and at most so different (chromaticity_distance); 0: whatever their colours
  size_t i_max = 200'000;  ///< points whose neighbours are looked at
};

/// Distance of (b, g, r) / (b + g + r), 0 .. 1.42: light and shade leave it alone. Black is as grey.
float chromaticity_distance(const Colour& a, const Colour& b);

/// Grows regions in one cloud after the other. Memory is taken by the constructor; nothing else allocates.
class RegionGrower {
 public:
  /// Takes the memory for clouds of up to `capacity` points: about 60 B a point, and 2 MB at least.
  explicit RegionGrower(size_t capacity);

  /// The cloud that regions are grown in; it must stay as it is meanwhile. At most `capacity` points, each usable().
  /// `colours` is as long, or empty: then they do not count.
  void fill(std::span<const Point> points, std::span<const Colour> colours, const GrowParameters& parameters);

  /// Begins the region of point `seed`.
  void begin(uint32_t seed, const Reach& reach);
  /// Looks at the neighbours of up to `count` more points. False once there is nothing left to do.
  bool advance(size_t count);
  /// Indices of the points found so far, the seed first, in the order in which they were found; those that one point
  /// brought, in the order of the cloud.
  std::span<const uint32_t> region() const { return std::span(region_).first(found_); }
  /// True if a neighbour of the region was left out because it lies beyond the reach.
  bool cut() const { return cut_; }

 private:
  void restore();
  void look_around(uint32_t index);
  void search_bucket(uint32_t bucket, const Point& from, const Colour& colour);
  /// Never negative: the origin lies below all points.
  uint32_t cell(float v, int axis) const {
    return static_cast<uint32_t>(static_cast<int64_t>((static_cast<double>(v) - origin_[axis]) * per_m_));
  }

  GrowParameters parameters_;
  std::span<const Point> points_;
  std::span<const Colour> colours_;
  cloud::CellSort cells_;
  cloud::CellLayout layout_;
  double origin_[3] = {}, per_m_ = 1;
  std::vector<cloud::SortedPoint> open_;  ///< by bucket; what a region has taken or refused stands last in its bucket
  std::vector<uint32_t> open_end_;        ///< of bucket b: open_[start()[b] .. open_end_[b]) is still open
  std::vector<uint32_t> touched_;         ///< buckets that are no longer as they were
  size_t touched_count_ = 0;
  std::vector<uint32_t> region_;
  size_t found_ = 0, looked_ = 0;
  Point seed_{};
  Reach reach_;
  bool cut_ = false;
};

/// What a region is, the slow and obvious way: every point against every other.
struct Region {
  std::vector<uint32_t> points;
  bool cut = false;
};
Region grow_reference(std::span<const Point> points, std::span<const Colour> colours, const GrowParameters& parameters,
                      uint32_t seed, const Reach& reach);

}  // namespace takt::object_3d
