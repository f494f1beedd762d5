// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/references.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "nodes/object_detection/shrink.hpp"

namespace takt::object_detection {
namespace {

Histogram histogram_of(const ReferenceView& reference, Stage stage, const DetectorParameters& p,
                       const OrientationBins& orientations) {
  const std::vector<uint8_t> pixels = shrunk_view(reference.view(), p.smallest);
  const auto side_px = static_cast<int>(std::lround(p.smallest * reference.side_px));
  const ImageView<const uint8_t> view(pixels.data(), side_px, side_px, 3);
  switch (stage) {
    case Stage::colour: return colour_histogram(view, p.bins);
    case Stage::orientation: return orientation_histogram(view, orientations);
    case Stage::cooccurrence:
    case Stage::layout: break;
  }
  return cooccurrence_histogram(view, p.pairs);
}

}  // namespace

std::vector<double> parse_scales(const std::string& text) {
  std::vector<double> scales;
  std::istringstream in(text);
  bool valid = !text.empty() && text.back() != '+';
  for (std::string word; std::getline(in, word, '+');) {
    size_t used = 0;
    double scale = 0;
    try {
      scale = std::stod(word, &used);
    } catch (const std::exception&) {
    }
    valid = valid && used == word.size() && scale >= 0.5 && scale <= (scales.empty() ? 1 : scales.back());
    valid = valid && (scales.empty() || scale < scales.back());
    scales.push_back(scale);
  }
  if (!valid)
    throw std::invalid_argument("scales are `" + text + "`, must be numbers in 0.5 .. 1, falling, such as 1+0.7+0.5");
  return scales;
}

CascadeReferences cascade_references(std::span<const DatabaseObject> database, const DetectorParameters& p) {
  if (database.empty() || database[0].views.empty()) throw std::invalid_argument("the object database is empty");
  const OrientationBins orientations(p.orientations);
  CascadeReferences stages;
  for (size_t s = 0; s < kHistogramStages && s <= static_cast<size_t>(p.last); ++s) {
    const double caps[] = {kColourCap, kOrientationCap, kCooccurrenceCap};
    const bool of_pairs = static_cast<Stage>(s) == Stage::cooccurrence;
    const double tolerance = of_pairs ? 1 - (1 - p.tolerance) * (1 - p.tolerance) : p.tolerance;
    for (const DatabaseObject& object : database) {
      auto& views = stages[s].histograms.emplace_back();
      for (const ReferenceView& view : object.views)
        views.push_back(histogram_of(view, static_cast<Stage>(s), p, orientations));
      const double of_object = object.thresholds[s].value_or(automatic_threshold(views, tolerance, caps[s]));
      auto& limits = stages[s].limits.emplace_back();
      for (size_t r = 0; r < views.size(); ++r)
        limits.push_back({views[r].mass, p.threshold_scale * object.views[r].thresholds[s].value_or(of_object)});
    }
  }
  return stages;
}

}  // namespace takt::object_detection
