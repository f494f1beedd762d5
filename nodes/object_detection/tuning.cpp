// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/tuning.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/object_detection/stage_errors.hpp"

namespace takt::object_detection {
namespace {

/// What the last stage's threshold must exceed for the object to be found in the image; none does that: 2.
float needed(const ErrorMaps& maps, const std::array<double, kHistogramStages>& thresholds) {
  float least = kFailed;
  for (size_t window = 0; window < maps.error[0].size(); ++window)
    if (maps.error[0][window] < thresholds[0] && maps.error[1][window] < thresholds[1])
      least = std::min(least, maps.error[2][window]);
  return least;
}

double share_below(std::span<const float> needed, double threshold) {
  const auto count = std::count_if(needed.begin(), needed.end(), [&](float n) { return n < threshold; });
  return needed.empty() ? 0 : static_cast<double>(count) / static_cast<double>(needed.size());
}

}  // namespace

ErrorMaps error_maps(ImageView<const uint8_t> bgr, const CascadeReferences& references, size_t object, int reference_px,
                     const DetectorParameters& p) {
  ErrorMaps maps;
  maps.grid = make_search_grid(bgr.width, bgr.height, reference_px, p.window_px);
  for (size_t s = 0; s < kHistogramStages; ++s)
    maps.error[s] = StageErrors(static_cast<Stage>(s), maps.grid, references[s].histograms[object], p).run(bgr);
  return maps;
}

Tuning tune(std::span<const ErrorMaps> with, std::span<const ErrorMaps> without, double miss) {
  if (with.empty()) throw std::invalid_argument("no image shows the object");
  std::array<std::vector<float>, 2> there;  // errors of the first stages where the object is
  for (const ErrorMaps& maps : with) {
    std::vector<float> sum = maps.error[0];
    for (size_t s = 1; s < kHistogramStages; ++s)
      for (size_t window = 0; window < sum.size(); ++window) sum[window] += maps.error[s][window];
    const auto window = static_cast<size_t>(std::min_element(sum.begin(), sum.end()) - sum.begin());
    for (size_t s = 0; s < 2; ++s) there[s].push_back(maps.error[s][window]);
  }
  Tuning tuning;
  for (size_t s = 0; s < 2; ++s) {
    std::sort(there[s].begin(), there[s].end());
    const auto rank = static_cast<size_t>(std::ceil((1 - miss) * static_cast<double>(with.size())));
    tuning.thresholds[s] = std::clamp(1.1 * there[s][std::max<size_t>(1, rank) - 1], 0.01, 1.0);
  }
  std::vector<float> needed_with, needed_without;
  for (const ErrorMaps& maps : with) needed_with.push_back(needed(maps, tuning.thresholds));
  for (const ErrorMaps& maps : without) needed_without.push_back(needed(maps, tuning.thresholds));
  // Between two neighbouring values of either list nothing changes.
  std::vector<double> steps{0, 1};
  for (const auto& list : {needed_with, needed_without})
    for (const float n : list)
      if (n < 1) steps.push_back(n);
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  for (size_t i = 0; i + 1 < steps.size(); ++i) {
    const double threshold = (steps[i] + steps[i + 1]) / 2;
    tuning.roc.push_back({threshold, share_below(needed_with, threshold), share_below(needed_without, threshold)});
  }
  const auto gain = [](const RocPoint& point) { return point.detected - point.false_positive; };
  const auto best = std::max_element(tuning.roc.begin(), tuning.roc.end(),
                                     [&](const auto& a, const auto& b) { return gain(a) < gain(b); });
  auto last = best;
  while (last + 1 != tuning.roc.end() && gain(*(last + 1)) == gain(*best)) ++last;
  tuning.chosen = *(best + (last - best) / 2);
  tuning.thresholds[2] = std::max(0.01, tuning.chosen.threshold);
  return tuning;
}

}  // namespace takt::object_detection
