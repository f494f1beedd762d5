// SPDX-License-Identifier: Apache-2.0
// Outlier removal of a point cloud (thesis Alg. 3.1 with two-phase deletion): a point needs n_min others within the
// radius. Exact: a grid of cells as wide as the radius narrows the candidates, the distance decides.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/cloud/cell_sort.hpp"
#include "nodes/cloud/count_kernel.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {

struct OutlierParameters {
  double radius_m = 0.20;
  int n_min = 100;  ///< other points needed within the radius; for 1.2 million points, see scaled_n_min
};

/// n_min for a thinner cloud of the same scene: in proportion to the points, at least 1.
int scaled_n_min(int n_min_full, size_t points, size_t points_full = 1200000);

class OutlierFilter {
 public:
  /// Takes the memory for clouds of up to `capacity` points (29 to 37 B a point, and 1 MB at least); filter() allocates
  /// nothing.
  explicit OutlierFilter(size_t capacity);

  /// keep[i] = 1 if points[i] has at least n_min others within the radius; returns how many. `keep` has the size of
  /// `points`. Points beyond the capacity are not kept. radius_m > 0.
  size_t filter(std::span<const Point> points, const OutlierParameters& parameters, std::span<uint8_t> keep);
  size_t capacity() const { return cells_.capacity(); }
  /// Points of the last cloud that were not usable().
  size_t unusable() const { return unusable_; }

  /// Slow, obvious version: every point against every other.
  static size_t filter_reference(std::span<const Point> points, const OutlierParameters& parameters,
                                 std::span<uint8_t> keep);

 private:
  static constexpr size_t kMostRuns = 22;
  void sort(std::span<const Point> points, const Bounds& bounds, double radius_m);
  uint32_t last_of_group(uint32_t first) const;
  size_t runs_around(uint32_t first, uint32_t last, std::span<Run> runs) const;

  size_t unusable_ = 0;
  CellSort cells_;
  CellLayout layout_;
  std::vector<uint8_t> pass_;
};

/// Moves the kept points (and colours, if there are any) to the front, in order; returns how many.
size_t compact(std::span<Point> points, std::span<Colour> colours, std::span<const uint8_t> keep);

}  // namespace takt::cloud
