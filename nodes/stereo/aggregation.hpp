// SPDX-License-Identifier: Apache-2.0
// Internal: aggregation of costs (thesis Sec. 3.2.2), row by row as the costs come.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/stereo/pixel_costs.hpp"

namespace takt::stereo {

/// Costs of one image row: for each pixel those of all disparities.
using CostRow = std::vector<float>;

/// Takes the costs of row after row and gives the aggregated ones. `square` gives sums, to stay whole-numbered; the
/// others means.
class Aggregator {
 public:
  Aggregator(int width, int height, const MatcherParameters& p);
  /// From the next start() on; with the windows of the constructor.
  void tune(const MatcherParameters& p);

  /// Before the first row of a pair; `image` guides what depends on it and must outlive the rows.
  void start(const Features& image, int disparities);
  /// Costs of the next row from above.
  void add(const CostRow& costs);
  /// How many rows must have been added before aggregated row y can be had (all, near the lower border).
  int rows_needed(int y) const;
  /// Aggregated costs of row y; each y once, in rising order.
  void take(int y, CostRow& out);

  /// What a mean cost is multiplied with in the result.
  int scale() const { return p_.aggregation == Aggregation::square ? p_.n_square * p_.n_square : 1; }

 private:
  struct Arms {
    int left, right, up, down;
  };
  size_t pixel(int x) const { return static_cast<size_t>(x) * static_cast<size_t>(disparities_); }
  const CostRow& row(int y) const;
  void aggregate(int y);
  void find_arms();
  void along_arms(const CostRow& costs, int y, CostRow& out) const;
  void sum(int y, int edge, CostRow& out);
  void within_arms(int y, CostRow& out) const;
  const Arms& arms_of(int x, int y) const {
    return arms_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
  }
  /// Mean over `before` cells on one side, the cell itself and `after` on the other, nearer ones weighing more.
  template <class CostsAt>
  void mean_of_arms(int before, int after, const CostsAt& costs_at, float* out) const;
  void weighted(int y, CostRow& out);
  void minimum(size_t size, int y, CostRow& out);

  MatcherParameters p_;
  int width_, height_, disparities_ = 0, added_ = 0, next_ = 0;
  const Features* image_ = nullptr;
  std::vector<int> edges_;                        ///< of the square windows
  std::vector<CostRow> costs_;                    ///< the last n_square rows
  std::vector<std::vector<CostRow>> aggregated_;  ///< for each window edge the last n_min rows
  CostRow columns_, smallest_;
  std::vector<Arms> arms_;
  std::vector<float> distance_weight_;
};

}  // namespace takt::stereo
