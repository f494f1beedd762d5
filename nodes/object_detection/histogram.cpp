// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/histogram.hpp"

#include <algorithm>
#include <numeric>

namespace takt::object_detection {
Histogram colour_histogram(ImageView<const uint8_t> view, ColourBins bins) {
  Histogram histogram;
  histogram.count.resize(kColourBins);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (is_background(view, x, y)) continue;
      ++histogram.count[colour_bin(view.at(x, y, 0), view.at(x, y, 1), view.at(x, y, 2), bins)];
      ++histogram.mass;
    }
  }
  return histogram;
}

Histogram orientation_histogram(ImageView<const uint8_t> view, const OrientationBins& bins) {
  const auto width = static_cast<size_t>(view.width);
  std::vector<uint8_t> values(OrientationBins::kValueRows * width);
  std::vector<uint16_t> index(width * static_cast<size_t>(view.height));
  bins.rows(view, 0, view.height, values.data(), index.data());
  Histogram histogram;
  histogram.count.resize(static_cast<size_t>(bins.count()));
  for (int y = 1; y + 1 < view.height; ++y) {
    for (int x = 1; x + 1 < view.width; ++x) {
      bool inside = true;
      for (int i = 0; i < 9; ++i) inside = inside && !is_background(view, x + i % 3 - 1, y + i / 3 - 1);
      const uint16_t bin = index[static_cast<size_t>(y) * width + static_cast<size_t>(x)];
      if (!inside || bin == bins.none()) continue;
      ++histogram.count[bin];
      ++histogram.mass;
    }
  }
  return histogram;
}

Histogram cooccurrence_histogram(ImageView<const uint8_t> view, const PairBins& bins) {
  std::vector<uint8_t> colours;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x)
      colours.push_back(is_background(view, x, y)
                            ? UINT8_MAX
                            : pair_colour(view.at(x, y, 0), view.at(x, y, 1), view.at(x, y, 2), bins.colours));
  Histogram histogram;
  histogram.count.resize(pair_bins(bins.colours, bins.distances));
  CooccurrenceCounter(view.width, bins.distances).count(colours.data(), bins.colours, histogram.count.data());
  histogram.mass = std::accumulate(histogram.count.begin(), histogram.count.end(), 0u);
  return histogram;
}

uint32_t missing_mass(std::span<const uint32_t> window, std::span<const uint32_t> reference) {
  uint32_t missing = 0;
  for (size_t i = 0; i < reference.size(); ++i)
    if (reference[i] > window[i]) missing += reference[i] - window[i];
  return missing;
}

double intersection_error(const Histogram& window, const Histogram& reference) {
  if (reference.mass == 0) return 0;
  return static_cast<double>(missing_mass(window.count, reference.count)) / static_cast<double>(reference.mass);
}

double automatic_threshold(std::span<const Histogram> views, double tolerance, double cap) {
  std::vector<double> errors;
  for (size_t i = 0; i < views.size(); ++i)
    for (size_t k = 0; k < views.size(); ++k)
      if (i != k) errors.push_back(intersection_error(views[i], views[k]));
  if (errors.empty()) return cap;
  std::sort(errors.begin(), errors.end());
  const size_t rank = (9 * errors.size() + 9) / 10;  // ceil(0.9 n)
  return std::min(cap, 1.25 * errors[rank - 1] + tolerance);
}

}  // namespace takt::object_detection
