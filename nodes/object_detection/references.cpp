// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/references.hpp"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "nodes/object_detection/shrink.hpp"

namespace takt::object_detection {
namespace {

Histogram histogram_of(ImageView<const uint8_t> view, Stage stage, const DetectorParameters& p,
                       const OrientationBins& orientations) {
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

ReferenceView shrunk(const ReferenceView& view, double scale) {
  constexpr uint8_t kObject = 204;  // four fifths of 255
  const ImageView<const uint8_t> from = view.view();
  std::vector<uint8_t> whole;
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x) whole.insert(whole.end(), 3, is_background(from, x, y) ? 0 : UINT8_MAX);
  Shrinker shrinker(from.width, from.height, scale), of_object(from.width, from.height, scale);
  const ImageView<const uint8_t> small = shrinker.run(from);
  const ImageView<const uint8_t> share = of_object.run({whole.data(), from.width, from.height, 3});
  ReferenceView out = view;
  out.side_px = small.width;
  out.pixels.assign(small.data, small.data + ptrdiff_t{3} * small.width * small.height);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      const bool object = share.at(x, y) >= kObject;
      if (!object || is_background(small, x, y))
        std::fill_n(out.pixels.begin() + ptrdiff_t{3} * (y * small.width + x), 3, object ? uint8_t{1} : uint8_t{0});
    }
  }
  return out;
}

CascadeReferences cascade_references(std::span<const DatabaseObject> database, const DetectorParameters& p) {
  if (database.empty() || database[0].views.empty()) throw std::invalid_argument("the object database is empty");
  const OrientationBins orientations(p.orientations);
  std::vector<std::vector<ReferenceView>> compared;  // with windows, per object
  for (const DatabaseObject& object : database) {
    auto& views = compared.emplace_back();
    for (const ReferenceView& view : object.views) views.push_back(shrunk(view, p.smallest));
  }
  CascadeReferences stages;
  for (size_t s = 0; s < kHistogramStages && s <= static_cast<size_t>(p.last); ++s) {
    const double caps[] = {kColourCap, kOrientationCap, kCooccurrenceCap};
    const bool of_pairs = static_cast<Stage>(s) == Stage::cooccurrence;
    const double tolerance = of_pairs ? 1 - (1 - p.tolerance) * (1 - p.tolerance) : p.tolerance;
    for (size_t o = 0; o < database.size(); ++o) {
      const DatabaseObject& object = database[o];
      auto& views = stages[s].histograms.emplace_back();
      for (const ReferenceView& view : compared[o])
        views.push_back(histogram_of(view.view(), static_cast<Stage>(s), p, orientations));
      const double of_object = object.thresholds[s].value_or(automatic_threshold(views, tolerance, caps[s]));
      auto& limits = stages[s].limits.emplace_back();
      for (size_t r = 0; r < views.size(); ++r)
        limits.push_back({views[r].mass, p.threshold_scale * object.views[r].thresholds[s].value_or(of_object)});
    }
  }
  return stages;
}

}  // namespace takt::object_detection
