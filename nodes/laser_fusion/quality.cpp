// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/quality.hpp"

#include <algorithm>
#include <cmath>

namespace takt::laser_fusion {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Sums over the pairs with squared distances of at most limit2; returns the sum of their distances. PairSums::add
/// would do, at a third of the speed.
double sum_up(const Neighbours& n, float limit2, PairSums& sums) {
  size_t pairs = 0;
  double distance_m = 0, p1[3] = {}, p2[3] = {}, p2_p1[9] = {};
  for (size_t i = 0; i < n.nearest.size(); ++i) {
    const Nearest& near = n.nearest[i];
    if (!(near.distance2 <= limit2)) continue;
    const Point &f = n.fixed[i], &m = n.moving[near.index];
    const double fixed[3] = {f.x, f.y, f.z}, moving[3] = {m.x, m.y, m.z};
    ++pairs;
    distance_m += std::sqrt(near.distance2);
    for (size_t a = 0; a < 3; ++a) {
      p1[a] += fixed[a];
      p2[a] += moving[a];
      for (size_t b = 0; b < 3; ++b) p2_p1[3 * a + b] += moving[a] * fixed[b];
    }
  }
  sums.pairs = pairs;
  sums.p1 = Eigen::Map<const Eigen::Vector3d>(p1);
  sums.p2 = Eigen::Map<const Eigen::Vector3d>(p2);
  sums.p2_p1 = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p2_p1);
  return distance_m;
}

Quality judge_truncated(const Neighbours& n, double cut_m, PairSums& sums) {
  const double distance_m = sum_up(n, static_cast<float>(cut_m * cut_m), sums);
  const auto pairs = static_cast<double>(sums.pairs), all = static_cast<double>(n.nearest.size());
  return {(distance_m + (all - pairs) * cut_m) / all, sums.pairs, distance_m / std::max(pairs, 1.0)};
}

/// d <= (d_max - d_min) / 2; all if no pair is (equal distances).
float overlap_limit2(std::span<const Nearest> nearest) {
  const auto [least, most] = std::minmax_element(
      nearest.begin(), nearest.end(), [](const Nearest& a, const Nearest& b) { return a.distance2 < b.distance2; });
  const float limit_m = (std::sqrt(most->distance2) - std::sqrt(least->distance2)) / 2;
  return limit_m * limit_m < least->distance2 ? most->distance2 : limit_m * limit_m;
}

Quality judge_thesis(const Neighbours& n, const QualityParameters& parameters, PairSums& sums) {
  const double distance_m = sum_up(n, overlap_limit2(n.nearest), sums);
  const auto pairs = static_cast<double>(sums.pairs);
  const double mean_m = distance_m / std::max(pairs, 1.0);
  return {thesis_score(pairs / static_cast<double>(n.nearest.size()), mean_m, parameters), sums.pairs, mean_m};
}

}  // namespace

double thesis_score(double share, double mean_distance_m, const QualityParameters& p) {
  return (2 - std::pow(share, p.share_exponent)) * (1 + std::pow(mean_distance_m, p.distance_exponent));
}

Quality judge(const Neighbours& neighbours, const QualityParameters& p, PairSums& sums) {
  Quality quality{kInfinite, 0, 0};
  sums = {};
  if (neighbours.nearest.empty() || neighbours.moving.empty()) return quality;
  quality =
      p.metric == Metric::truncated ? judge_truncated(neighbours, p.cut_m, sums) : judge_thesis(neighbours, p, sums);
  if (quality.pairs < kLeastPairs) quality.score = kInfinite;
  return quality;
}

}  // namespace takt::laser_fusion
