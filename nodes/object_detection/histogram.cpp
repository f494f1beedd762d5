// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/histogram.hpp"

#include <algorithm>

namespace takt::object_detection {

Histogram colour_histogram(ImageView<const uint8_t> view, ColourBins bins) {
  Histogram histogram;
  histogram.count.resize(kColourBins);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const uint8_t b = view.at(x, y, 0), g = view.at(x, y, 1), r = view.at(x, y, 2);
      if ((b | g | r) == 0) continue;
      ++histogram.count[colour_bin(b, g, r, bins)];
      ++histogram.mass;
    }
  }
  return histogram;
}

uint32_t missing_mass(std::span<const uint16_t> window, std::span<const uint16_t> reference) {
  uint32_t missing = 0;
  for (size_t i = 0; i < reference.size(); ++i)
    if (reference[i] > window[i]) missing += static_cast<uint32_t>(reference[i] - window[i]);
  return missing;
}

double intersection_error(const Histogram& window, const Histogram& reference) {
  return static_cast<double>(missing_mass(window.count, reference.count)) / static_cast<double>(reference.mass);
}

double automatic_threshold(std::span<const Histogram> views, double tolerance) {
  std::vector<double> errors;
  for (size_t i = 0; i < views.size(); ++i)
    for (size_t k = 0; k < views.size(); ++k)
      if (i != k) errors.push_back(intersection_error(views[i], views[k]));
  if (errors.empty()) return kThresholdCap;
  std::sort(errors.begin(), errors.end());
  const size_t rank = (9 * errors.size() + 9) / 10;  // ceil(0.9 n)
  return std::min(kThresholdCap, 1.25 * errors[rank - 1] + tolerance);
}

}  // namespace takt::object_detection
