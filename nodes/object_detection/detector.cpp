// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/detector.hpp"

#include <stdexcept>

namespace takt::object_detection {
namespace {

SearchGrid grid_for(int width, int height, std::span<const DatabaseObject> database, int window_px) {
  if (database.empty() || database[0].views.empty()) throw std::invalid_argument("the object database is empty");
  return make_search_grid(width, height, database[0].views[0].side_px, window_px);
}

std::vector<std::vector<Histogram>> histograms(std::span<const DatabaseObject> database, ColourBins bins) {
  std::vector<std::vector<Histogram>> objects;
  for (const DatabaseObject& object : database) {
    auto& views = objects.emplace_back();
    for (const ReferenceView& view : object.views) views.push_back(colour_histogram(view.view(), bins));
  }
  return objects;
}

/// A view's own threshold goes before the object's, and that before the automatic one.
std::vector<std::vector<ReferenceLimit>> limits_of(std::span<const DatabaseObject> database,
                                                   std::span<const std::vector<Histogram>> references,
                                                   const DetectorParameters& p) {
  std::vector<std::vector<ReferenceLimit>> limits;
  for (size_t o = 0; o < database.size(); ++o) {
    const double of_object =
        database[o].threshold ? *database[o].threshold : automatic_threshold(references[o], p.tolerance);
    auto& object = limits.emplace_back();
    for (size_t r = 0; r < references[o].size(); ++r)
      object.push_back({references[o][r].mass, p.threshold_scale * database[o].views[r].threshold.value_or(of_object)});
  }
  return limits;
}

}  // namespace

Detector::Detector(int image_width, int image_height, std::span<const DatabaseObject> database,
                   const DetectorParameters& p)
    : grid_(grid_for(image_width, image_height, database, p.window_px)),
      references_(histograms(database, p.bins)),
      limits_(limits_of(database, references_, p)),
      colour_(grid_, p.bins, references_),
      decision_(grid_, limits_) {}

bool Detector::begin(ImageView<const uint8_t> bgr) {
  if (bgr.width != grid_.image_width || bgr.height != grid_.image_height || bgr.channels != 3) return false;
  colour_.begin(bgr, first_row_);
  return true;
}

void Detector::end() {
  first_row_ = searched_rows_ == grid_.rows ? 0 : (first_row_ + searched_rows_) % grid_.rows;
  decision_.decide(colour_.missing());
}

}  // namespace takt::object_detection
