// SPDX-License-Identifier: Apache-2.0
// Learns a cascade: boosted stumps over Haar features, stage after stage, each against negatives that all stages before
// let pass (thesis Sec. 3.4.1, Fig. 3.18; OpenCV 4 has no trainer).
#pragma once
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "nodes/traffic_signs/cascade.hpp"
#include "nodes/traffic_signs/grouping.hpp"

namespace takt::traffic_signs {

/// An image that windows without the object are cut out of.
struct NegativeImage {
  cv::Mat1b grey;
  std::vector<Box> objects;  ///< windows that touch one of these are left out
};

struct TrainingSet {
  std::vector<cv::Mat1b> positives;  ///< windows, all of one size
  std::vector<NegativeImage> negatives;
};

struct TrainingParameters {
  int stages = 16;
  double least_hit_rate = 0.997;   ///< of the positives, each stage
  double most_false_alarms = 0.4;  ///< of the stage's negatives, each stage
  int negatives = 2000;            ///< for each stage
  int least_negatives = 60;        ///< training ends when all images together give fewer
  int from_one_image = 40;         ///< negatives at most
  int features = 2500;             ///< drawn for each stage, out of all
  int most_stumps = 80;            ///< a stage
  double scale_factor = 1.2;       ///< of the search for negatives
  uint64_t seed = 1;
};

/// Learns from the set. Calls `progress` after each stage with the cascade so far. Equal arguments give equal cascades.
/// Throws std::invalid_argument if there are no positives or no negatives, or their sizes do not fit.
Cascade train_cascade(const TrainingSet& set, const TrainingParameters& parameters,
                      const std::function<void(const Cascade&)>& progress);

/// What a cascade's first 1, 2 ... stages alone let pass, of a set that it did not learn from (Fig. 3.18).
struct StageCurve {
  std::vector<double> missed_pct;                   ///< of the positives
  std::vector<double> false_positives_per_million;  ///< windows of the negatives, at all scales
};
StageCurve stage_curve(const Cascade& cascade, const TrainingSet& set, double scale_factor);

}  // namespace takt::traffic_signs
