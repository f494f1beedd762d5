// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/boosting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

namespace takt::traffic_signs {
namespace {

constexpr size_t kBins = 128;  // thresholds that are tried for a feature, evenly over its range

/// A feature's values in bins, so that the best threshold needs no sorting.
struct BinnedFeature {
  float lowest = 0, width = 0;  ///< of a bin
  std::vector<uint8_t> bins;
};

BinnedFeature binned(std::span<const float> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  BinnedFeature out{*low, std::max((*high - *low) / kBins, 1e-9f), std::vector<uint8_t>(values.size())};
  for (size_t i = 0; i < values.size(); ++i)
    out.bins[i] = static_cast<uint8_t>(std::clamp((values[i] - out.lowest) / out.width, 0.0f, kBins - 1.0f));
  return out;
}

/// Weights of a group of samples: all, and the positives' less the negatives'.
struct Weights {
  double all = 0, difference = 0;
  /// How much less squared error there is if the group gets its own mean: of what a split is chosen by.
  double gain() const { return all > 0 ? difference * difference / all : 0; }
  float mean() const { return all > 0 ? static_cast<float>(difference / all) : 0.0f; }
};

struct Split {
  size_t feature = 0, bin = 0;  ///< below: bins before this one
  double gain = -1;
};

Split best_split(const std::vector<BinnedFeature>& features, std::span<const float> weights,
                 std::span<const float> signed_weights) {
  Split best;
  for (size_t f = 0; f < features.size(); ++f) {
    std::array<std::array<float, 2>, kBins> histogram{};
    const std::vector<uint8_t>& bins = features[f].bins;
    for (size_t i = 0; i < bins.size(); ++i) {
      histogram[bins[i]][0] += weights[i];
      histogram[bins[i]][1] += signed_weights[i];
    }
    Weights total, below;
    for (const auto& [all, difference] : histogram)
      total.all += static_cast<double>(all), total.difference += static_cast<double>(difference);
    for (size_t bin = 1; bin < kBins; ++bin) {
      below.all += static_cast<double>(histogram[bin - 1][0]);
      below.difference += static_cast<double>(histogram[bin - 1][1]);
      const double gain = below.gain() + Weights{total.all - below.all, total.difference - below.difference}.gain();
      if (gain > best.gain) best = {f, bin, gain};
    }
  }
  return best;
}

}  // namespace

bool Samples::add(const cv::Mat1b& window, bool positive) {
  cv::Mat sums;
  cv::integral(window, sums, CV_32S);
  const cv::Mat1b inner = window(cv::Rect(1, 1, window_.width - 2, window_.height - 2));
  const double area = static_cast<double>(inner.total()), total = cv::sum(inner)[0];
  const double spread = area * cv::norm(inner, cv::NORM_L2SQR) - total * total;
  if (!(spread > 0)) return false;
  const auto norm = static_cast<float>(1 / std::sqrt(spread));
  if (!(area * static_cast<double>(norm) < 0.1)) return false;
  added_.insert(added_.end(), sums.begin<int>(), sums.end<int>());
  norms_.push_back(norm);
  positive_.push_back(positive);
  return true;
}

void Samples::finish() {
  const size_t places = static_cast<size_t>((window_.width + 1) * (window_.height + 1));
  sums_.resize(added_.size());
  for (size_t sample = 0; sample < count(); ++sample)
    for (size_t place = 0; place < places; ++place) sums_[place * count() + sample] = added_[sample * places + place];
  added_ = {};
}

size_t Samples::positives() const {
  return static_cast<size_t>(std::count(positive_.begin(), positive_.end(), uint8_t{1}));
}

void Samples::values(const HaarFeature& feature, std::span<float> out) const {
  std::fill(out.begin(), out.end(), 0.0f);
  for (const WeightedRect& r : feature) {
    if (r.weight == 0) continue;
    const int32_t *a = &sums_[place(r.x, r.y)], *b = &sums_[place(r.x + r.width, r.y)],
                  *c = &sums_[place(r.x, r.y + r.height)], *d = &sums_[place(r.x + r.width, r.y + r.height)];
    for (size_t i = 0; i < out.size(); ++i) out[i] += r.weight * static_cast<float>(a[i] - b[i] - c[i] + d[i]);
  }
  for (size_t i = 0; i < out.size(); ++i) out[i] *= norms_[i];
}

Stage boost_stage(const Samples& samples, std::span<const HaarFeature> features, const BoostingParameters& p) {
  const size_t count = samples.count(), positives = samples.positives();
  std::vector<float> values(count), weights(count), signed_weights(count);
  std::vector<BinnedFeature> table;
  for (const HaarFeature& feature : features) {
    samples.values(feature, values);
    table.push_back(binned(values));
  }
  for (size_t i = 0; i < count; ++i)  // both kinds weigh the same together
    weights[i] = 0.5f / static_cast<float>(samples.positive(i) ? positives : count - positives);
  Stage stage;
  std::vector<double> votes(count), of_positives;
  while (static_cast<int>(stage.stumps.size()) < p.most_stumps) {
    const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (size_t i = 0; i < count; ++i) {
      weights[i] = static_cast<float>(weights[i] / all);
      signed_weights[i] = samples.positive(i) ? weights[i] : -weights[i];
    }
    const Split split = best_split(table, weights, signed_weights);
    const BinnedFeature& chosen = table[split.feature];
    Stump stump{static_cast<int>(split.feature), chosen.lowest + static_cast<float>(split.bin) * chosen.width, 0, 0};
    samples.values(features[split.feature], values);
    Weights below, otherwise;
    for (size_t i = 0; i < count; ++i) {
      Weights& side = values[i] < stump.threshold ? below : otherwise;
      side.all += static_cast<double>(weights[i]);
      side.difference += static_cast<double>(signed_weights[i]);
    }
    stump.below = below.mean();
    stump.otherwise = otherwise.mean();
    stage.stumps.push_back(stump);
    of_positives.clear();
    for (size_t i = 0; i < count; ++i) {
      const float vote = values[i] < stump.threshold ? stump.below : stump.otherwise;
      votes[i] += static_cast<double>(vote);
      weights[i] *= std::exp(samples.positive(i) ? -vote : vote);
      if (samples.positive(i)) of_positives.push_back(votes[i]);
    }
    const auto lost =
        of_positives.begin() + static_cast<ptrdiff_t>((1 - p.least_hit_rate) * static_cast<double>(positives));
    std::nth_element(of_positives.begin(), lost, of_positives.end());
    stage.threshold = std::nextafter(static_cast<float>(*lost), -1e9f);
    size_t alarms = 0;
    for (size_t i = 0; i < count; ++i)
      alarms += !samples.positive(i) && votes[i] >= static_cast<double>(stage.threshold);
    if (static_cast<double>(alarms) <= p.most_false_alarms * static_cast<double>(count - positives)) break;
  }
  return stage;
}

}  // namespace takt::traffic_signs
