// SPDX-License-Identifier: Apache-2.0
// A whole registration of two clouds of any size and scale, for tools: thinned out, stripped of small clusters,
// searched, and refined with all their points.
#pragma once
#include <optional>

#include "nodes/cloud/cloud.hpp"
#include "nodes/laser_fusion/genetic_icp.hpp"
#include "nodes/laser_fusion/matcher.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

struct RegistrationParameters {
  size_t points = 1000;  ///< of each thinned cloud at most
  Metric metric = Metric::truncated;
  double cut_m = 0;  ///< of the search; 0: 1.25 times the larger spacing of the thinned clouds
  size_t least_cluster = 10;
  GeneticParameters genetic{};
  uint64_t seed = 1;
};

class Registration {
 public:
  /// moving is brought to fixed. Throws std::invalid_argument for clouds of fewer than kLeastPairs usable points.
  Registration(const cloud::CloudView& fixed, const cloud::CloudView& moving, const RegistrationParameters& parameters);

  /// Genetic ICP from a start pose, of the thinned clouds.
  Rigid search(const Rigid& start);
  /// Plain ICP from there, of the thinned clouds; the cut goes down to that of the search from four times that.
  Rigid plain(const Rigid& start);
  /// Generalised ICP, likewise.
  Rigid generalised(const Rigid& start);
  /// Plain ICP with all points, the cut going down from that of the search to three times the spacing of the clouds as
  /// they came.
  Rigid refined(const Rigid& pose);

  /// Of the thinned clouds, as the search judges and by Eq. 4.18.
  Quality judged(const Rigid& pose) { return thinned_->evaluate(pose); }
  Quality judged_by_thesis(const Rigid& pose);

  double cut_m() const { return thinned_->parameters().cut_m; }
  double last_cut_m() const { return last_cut_m_; }
  size_t fixed_points() const { return thinned_->fixed().size(); }    ///< thinned
  size_t moving_points() const { return thinned_->moving().size(); }  ///< thinned

 private:
  RegistrationParameters parameters_;
  std::vector<Point> fixed_, moving_;  ///< all that refined() uses
  double last_cut_m_ = 0;
  std::optional<Matcher> thinned_;
};

}  // namespace takt::laser_fusion
