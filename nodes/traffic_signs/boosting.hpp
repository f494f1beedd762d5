// SPDX-License-Identifier: Apache-2.0
// One stage of a cascade by Gentle AdaBoost (Friedman, Hastie, Tibshirani, Additive logistic regression, 2000).
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "nodes/traffic_signs/cascade.hpp"

namespace takt::traffic_signs {

/// Windows of one size as sums of pixels, sample after sample at each place: a feature of all samples is a few rows of
/// them. Values are those that the search computes, bit for bit.
class Samples {
 public:
  explicit Samples(cv::Size window) : window_(window) {}
  /// False, and nothing added, if the window is too flat to be searched.
  bool add(const cv::Mat1b& window, bool positive);
  /// After the last add() and before the first values().
  void finish();

  size_t count() const { return norms_.size(); }
  size_t positives() const;
  bool positive(size_t sample) const { return positive_[sample] != 0; }
  /// The feature's value of every sample.
  void values(const HaarFeature& feature, std::span<float> out) const;

 private:
  size_t place(int x, int y) const { return static_cast<size_t>(y * (window_.width + 1) + x) * count(); }

  cv::Size window_;
  std::vector<int32_t> added_, sums_;
  std::vector<float> norms_;
  std::vector<uint8_t> positive_;
};

struct BoostingParameters {
  double least_hit_rate;     ///< of the positives
  double most_false_alarms;  ///< of the negatives
  int most_stumps;
};

/// Adds stumps over `features` until the stage lets pass at most the false alarms at a threshold at which it keeps the
/// hit rate, or has the most stumps. Stump::feature is the index in `features`.
Stage boost_stage(const Samples& samples, std::span<const HaarFeature> features, const BoostingParameters& parameters);

}  // namespace takt::traffic_signs
