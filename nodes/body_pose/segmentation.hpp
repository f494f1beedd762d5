// SPDX-License-Identifier: Apache-2.0
// Which points of a cloud could be persons (thesis Sec. 3.3.2, 3.3.4; ). Floor frame:
// z up, floor z = 0. Seeds are heads: peaks of the scene seen from above that are as wide as a head.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/cloud/cell_sort.hpp"
#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/cloud/voxel_grid.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

struct SegmentationParameters {
  cloud::OutlierParameters outliers{0.08, 6};  ///< Alg. 3.1: what stereo smears between a body and what is behind it
  double voxel_m = 0.03;                       ///< the cloud is reduced to one point a voxel
  double range_m = 5.0;                        ///< farther points, seen from above, are left out
  double floor_m = 0.08;                       ///< lower ones are floor
  double ceiling_m = 2.4;                      ///< higher ones are no body
  double grow_m = 0.12;                        ///< neighbours in a cluster are no farther apart (d_max)
  double reach_m = 1.0, reach_up_m = 0.8, reach_down_m = 2.0;   ///< cylinder around a head that its body stays in
  double head_min_m = 0.9;                                      ///< heads are no lower
  double head_link_m = 0.07;                                    ///< points of a head hang together over so much
  double head_spread_min_m = 0.030, head_spread_max_m = 0.080;  ///< standard deviation across the line of sight
  double trunk_below_min = 0.3;    ///< share of the points half a metre below a head that lie right below it
  double trunk_to_head_min = 1.2;  ///< the same deviation of these points, of the head's
  double head_middle_m = 0.13;     ///< of the head, below its top
  int head_points = 8;
  int points_min = 180, points_max = 12000;  ///< of a cluster; 400 .. 27000 at voxels of 2 cm
  double head_above_min_m = 0.25, head_above_max_m = 1.2, head_beside_m = 0.5;  ///< from the cluster's centroid
  double density_min = 220;  ///< points in a m^3 of its box; 500 at voxels of 2 cm
  int candidates = 16;       ///< at most
};

/// A cluster that could be a body: points first .. first + count - 1 of Segmentation::points().
struct Candidate {
  size_t first = 0, count = 0;
  Point head{};
  float top_m = 0;
};

/// A head: where it is, and the height of its top.
struct Seed {
  Point head{};
  float top_m = 0;
};

class Segmentation {
 public:
  /// Takes the memory for clouds of up to `capacity` points (about 200 B a point); run() allocates nothing.
  Segmentation(size_t capacity, const SegmentationParameters& parameters);
  /// From the next run() on; range_m, ceiling_m, grow_m, points_max and candidates stay as they were.
  void tune(SegmentationParameters parameters);

  /// Nearest to the origin first.
  std::span<const Candidate> run(std::span<const Point> points);

  /// Cluster after cluster, in the order of the candidates.
  std::span<const Point> points() const { return std::span(clustered_).first(clustered_count_); }
  /// The cloud after reduction, floor and far points gone, and the seeds: what grow_reference() wants.
  std::span<const Point> reduced() const { return std::span(reduced_).first(count_); }
  std::span<const Seed> seeds() const { return seeds_; }
  const SegmentationParameters& parameters() const { return p_; }

 private:
  static constexpr double kMapCell_m = 0.05;
  template <class Visit>
  void for_each_near(const Point& p, float radius_m, const Visit& visit) const;
  int cell_of(float v, float low) const { return static_cast<int>((v - low) * per_edge_); }
  void reduce(std::span<const Point> points);
  void sort();
  void find_seeds();
  bool is_peak(int column, int row) const;
  bool judge_head(uint32_t top, Seed& seed);
  size_t gather_head(uint32_t top);
  void drop_lower_neighbours();
  void grow();
  bool plausible(size_t label) const;
  void collect();

  SegmentationParameters p_;
  cloud::OutlierFilter outliers_;
  std::vector<uint8_t> keep_;
  cloud::VoxelGrid grid_;
  cloud::CellSort cells_;
  cloud::CellLayout layout_;
  float edge_m_, per_edge_;
  int across_, up_;  ///< cells along x and y, and along z
  std::vector<Point> cropped_, reduced_, clustered_;
  size_t count_ = 0, clustered_count_ = 0;
  int map_side_;
  std::vector<float> map_;     ///< highest point above each cell of the floor
  std::vector<uint32_t> top_;  ///< which one that is
  std::vector<Seed> seeds_;
  std::vector<int32_t> label_;  ///< of reduced points: seed, -1 none; while seeds are sought: peak
  std::vector<uint32_t> queue_;
  std::vector<Candidate> candidates_;
};

/// Whether a body with that head may reach to p.
inline bool within_reach(const SegmentationParameters& p, const Point& head, const Point& q) {
  const float x = q.x - head.x, y = q.y - head.y, z = q.z - head.z;
  return x * x + y * y <= static_cast<float>(p.reach_m * p.reach_m) && z <= static_cast<float>(p.reach_up_m) &&
         z >= -static_cast<float>(p.reach_down_m);
}
/// A cluster begins with a head and what is right below it, down to the chest: the neck may be hidden.
inline bool begins_at(const Point& head, const Point& q) {
  constexpr float kRadius_m = 0.16f, kDown_m = 0.45f;
  const float x = q.x - head.x, y = q.y - head.y, z = q.z - head.z;
  return x * x + y * y <= kRadius_m * kRadius_m && z <= kRadius_m && z >= -kDown_m;
}
inline float squared_distance(const Point& a, const Point& b) {
  const float x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return x * x + y * y + z * z;
}

/// Region growing (Alg. 3.2) from all heads at once, the obvious way: round after round every point that is not yet
/// labelled looks at all others. A point belongs to the head that reaches it in fewest steps, of several to the first;
/// -1 to none.
std::vector<int32_t> grow_reference(const SegmentationParameters& p, std::span<const Point> points,
                                    std::span<const Seed> seeds);

}  // namespace takt::body_pose
