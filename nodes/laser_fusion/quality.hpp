// SPDX-License-Identifier: Apache-2.0
// How well two clouds fit (thesis Sec. 4.4.2, Eq. 4.18), less is better.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "nodes/laser_fusion/nearest_table.hpp"
#include "nodes/laser_fusion/rigid_fit.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

/// truncated: mean of min(d, cut) over the fixed points, m; pairs are at most cut apart (C-4).
/// thesis: Eq. 4.18, 1..4 and above; pairs are at most half the range of all distances apart (E-28), which lets wrong
/// poses score better than the true one.
enum class Metric : uint8_t { truncated, thesis };

struct QualityParameters {
  Metric metric = Metric::truncated;
  double cut_m = 0.25;             ///< of metric truncated; above 0
  double share_exponent = 2;       ///< of metric thesis
  double distance_exponent = 0.5;  ///< of metric thesis
};

struct Quality {
  double score;            ///< infinite if there are fewer than kLeastPairs pairs
  size_t pairs;            ///< N_hat, fixed points that have a partner
  double mean_distance_m;  ///< d_m, of the pairs; 0 without any
};

/// Eq. 4.18: (2 - rho^2) (1 + sqrt(d_m)), with other exponents if so told. share = rho = N_hat / N1, 0..1.
double thesis_score(double share, double mean_distance_m, const QualityParameters& parameters);

/// For each fixed point the nearest moving one, anywhere; `nearest` holds one for each.
struct Neighbours {
  std::span<const Point> fixed, moving;
  std::span<const Nearest> nearest;
};

/// Judges, and tells the sums over the pairs it keeps. With metric truncated a neighbour beyond the cut may be any that
/// is beyond it, or none.
Quality judge(const Neighbours& neighbours, const QualityParameters& parameters, PairSums& sums);

}  // namespace takt::laser_fusion
