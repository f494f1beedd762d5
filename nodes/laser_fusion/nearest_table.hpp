// SPDX-License-Identifier: Apache-2.0
// The nearest point of a cloud, looked up instead of searched for: space is cut into voxels, and each voxel lists every
// point that is the nearest one to some place within it. Exact, also in ties.
#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "nodes/cloud/count_kernel.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

/// Each operation rounded to float, in this order: every way to find a neighbour decides alike.
inline float distance2(const Point& a, const Point& b) {
  const float x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return x * x + y * y + z * z;
}

/// A point of a cloud; kNoPoint if there is none.
struct Nearest {
  static constexpr uint32_t kNoPoint = UINT32_MAX;
  uint32_t index = kNoPoint;
  float distance2 = std::numeric_limits<float>::infinity();  ///< m^2

  void consider(uint32_t i, float d2) {
    const bool nearer = d2 < distance2;
    index = nearer ? i : index;
    distance2 = nearer ? d2 : distance2;
  }
};

/// Every point looked at: of equally near ones the first. Points that are not usable() are none.
Nearest nearest_reference(std::span<const Point> points, const Point& place);

/// R^T (p - t): where a point of the parent frame lies in the child frame. In float, each operation rounded.
struct IntoChild {
  float r[9];  ///< R^T, row-major
  float t[3];

  Point operator()(const Point& p) const {
    const float x = p.x - t[0], y = p.y - t[1], z = p.z - t[2];
    return {r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z};
  }
};

class NearestTable {
 public:
  static constexpr size_t kUsualVoxels = size_t{1} << 19;

  /// Takes the memory for clouds of up to `points` points, of which build() then needs no more: about 24 B a voxel and
  /// 140 B a point.
  explicit NearestTable(size_t points, size_t voxels = kUsualVoxels);

  /// For `points` (copied; at most capacity()), from now on. Voxels have an edge of reach / divisions, or more if there
  /// would be too many of them or their lists too long. reach_m above 0, divisions 1..kMostDivisions.
  void build(std::span<const Point> points, double reach_m, int divisions = kMostDivisions);
  /// The same for the points that it has.
  void set_reach(double reach_m, int divisions = kMostDivisions);
  /// The same in portions of some tenths of a millisecond: nothing may be looked up before go_on() has said that it is
  /// done.
  void begin(std::span<const Point> points, double reach_m, int divisions = kMostDivisions);
  bool go_on();

  /// What nearest_reference() gives, if that is within reach; else a farther point or none.
  Nearest nearest(const Point& place) const { return nearest_in(voxel_of(place), place); }
  /// The same for each of `points`, moved: nearest[i] is that of into_child(points[i]).
  void nearest(const IntoChild& into_child, std::span<const Point> points, std::span<Nearest> nearest) const;

  std::span<const Point> points() const { return points_; }
  size_t capacity() const { return capacity_; }
  double edge_m() const { return edge_m_; }
  size_t entries() const { return start_[voxels_]; }
  size_t voxels() const { return voxels_; }

  static constexpr int kMostDivisions = 4;

 private:
  /// Voxels along one axis that a point may be within reach of: squares of its least and its largest distance to them.
  struct Span {
    static constexpr int kMost = 2 * kMostDivisions + 3;
    size_t first = 0;
    int count = 0;
    float near2[kMost], far2[kMost];
  };

  size_t voxel_of(const Point& p) const {
    const float x = (p.x - origin_[0]) * per_m_, y = (p.y - origin_[1]) * per_m_, z = (p.z - origin_[2]) * per_m_;
    const bool inside = (x >= 0) & (x < size_[0]) & (y >= 0) & (y < size_[1]) & (z >= 0) & (z < size_[2]);
    if (!inside) return voxels_;  // whose list is empty
    return (static_cast<size_t>(z) * count_[1] + static_cast<size_t>(y)) * count_[0] + static_cast<size_t>(x);
  }
  Nearest nearest_in(size_t voxel, const Point& place) const {
    Nearest best;
    for (uint32_t e = start_[voxel]; e != start_[voxel + 1]; ++e)
      best.consider(entries_[e], laser_fusion::distance2(place, points_[entries_[e]]));
    return best;
  }
  /// What is done with each voxel or each point, one after the other.
  enum class Pass : uint8_t { clear, bound, widen, count, sum, fill, done };

  void begin_reach(double reach_m, int divisions);
  void divide(double edge_m);
  bool lay_out(double edge_m);
  void pass_voxels(size_t first, size_t last);
  void pass_points(size_t first, size_t last);
  Span span_of(float coordinate, size_t axis) const;
  /// Calls visit(voxel, near2, far2) for the voxels that are about within reach of a point.
  template <class Visit>
  void for_each_voxel(const Point& point, const Visit& visit) const;

  size_t capacity_, most_voxels_;
  Pass pass_ = Pass::done;
  size_t next_ = 0;      ///< voxel or point that the pass goes on with
  uint64_t listed_ = 0;  ///< entries of the voxels that were summed up
  cloud::Bounds bounds_;
  double farthest_m_ = 0;  ///< coordinate
  double reach_m_ = 0, edge_m_ = 0;
  float per_m_ = 0, slack_m_ = 0;
  float origin_[3] = {}, size_[3] = {};
  size_t count_[3] = {};
  size_t voxels_ = 0;
  std::vector<Point> points_;
  std::vector<float> bound2_;      ///< of each voxel: some point is at most so far from everything in it
  std::vector<uint32_t> start_;    ///< start_[v] .. start_[v + 1] - 1 are the entries of voxel v
  std::vector<uint32_t> entries_;  ///< indices of points, in their order
};

}  // namespace takt::laser_fusion
