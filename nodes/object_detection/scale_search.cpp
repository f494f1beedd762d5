// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/scale_search.hpp"

#include <algorithm>

namespace takt::object_detection {
namespace {

SearchGrid scaled_grid(const std::optional<Shrinker>& shrinker, int width, int height, int reference_px, int window) {
  if (shrinker) return make_search_grid(shrinker->width(), shrinker->height(), reference_px, window);
  return make_search_grid(width, height, reference_px, window);
}

std::optional<Shrinker> shrinker_for(int width, int height, double scale) {
  if (scale == 1) return std::nullopt;
  return Shrinker(width, height, scale);
}

}  // namespace

ScaleSearch::ScaleSearch(int image_width, int image_height, double scale, int reference_px,
                         const CascadeReferences& references, const std::vector<LayoutObject>& layout,
                         const DetectorParameters& p)
    : shrinker_(shrinker_for(image_width, image_height, scale)),
      grid_(scaled_grid(shrinker_, image_width, image_height, reference_px, p.window_px)),
      to_image_x_(static_cast<double>(image_width) / grid_.image_width),
      to_image_y_(static_cast<double>(image_height) / grid_.image_height),
      colour_(grid_, p.bins, references[0].histograms),
      decision_(grid_, references[0].histograms.size()),
      wanted_(static_cast<size_t>(grid_.windows())) {
  for (const StageReferences& stage : references) limits_.emplace_back(stage.limits);
  for (const auto& views : references[0].histograms) views_.push_back(views.size());
  if (p.last >= Stage::orientation)
    orientation_.emplace(grid_, OrientationBins(p.orientations), references[1].histograms);
  if (p.last >= Stage::cooccurrence) cooccurrence_.emplace(grid_, p.pairs, references[2].histograms);
  if (p.last >= Stage::layout) layout_.emplace(grid_, reference_px, layout);
}

void ScaleSearch::to_image(Detection& detection) const {
  detection.x_px = static_cast<float>(detection.x_px * to_image_x_);
  detection.y_px = static_cast<float>(detection.y_px * to_image_y_);
  detection.width_px = static_cast<float>(detection.width_px * to_image_x_);
  detection.height_px = static_cast<float>(detection.height_px * to_image_y_);
}

void ScaleSearch::clear() {
  decision_.clear();
  begun_ = false;
}

void ScaleSearch::begin(ImageView<const uint8_t> bgr, const MaskSums* mask, int first_row) {
  begun_ = true;
  image_ = shrinker_ ? shrinker_->run(bgr) : bgr;
  std::fill(wanted_.begin(), wanted_.end(), uint8_t{1});
  for (int window = 0; mask != nullptr && window < grid_.windows(); ++window) {
    const int x0 = grid_.x0(window % grid_.columns), y0 = grid_.y0(window / grid_.columns);
    wanted_[static_cast<size_t>(window)] =
        mask->any(x0, y0, x0 + grid_.window_px, y0 + grid_.window_px, grid_.image_width, grid_.image_height);
  }
  colour_.begin(image_, first_row, wanted_);
  if (orientation_) orientation_->begin(image_);
}

void ScaleSearch::search_row() {
  const auto columns = static_cast<size_t>(grid_.columns);
  const size_t first = static_cast<size_t>(colour_.search_row()) * columns;
  for (size_t window = first; window < first + columns; ++window) {
    if (wanted_[window] == 0) continue;
    const uint16_t* missing = colour_.missing().data() + window * colour_.references();
    bool there = false;
    for (size_t object = 0; object < decision_.objects(); ++object) {
      float error = limits_[0].error(object, missing);
      missing += views_[object];
      if (error == kFailed) continue;
      if (orientation_) {
        if (!there) orientation_->go_to(window);
        there = true;
        error = limits_[1].error(object, orientation_->missing(object).data());
      }
      decision_.set(object, window, error);
    }
  }
}

void ScaleSearch::will_decide(std::span<const WindowOfObject> windows) {
  if (cooccurrence_) cooccurrence_->count_ahead(image_, windows);
}

void ScaleSearch::decide(size_t object, size_t window) {
  const float error = limits_[2].error(object, cooccurrence_->missing(image_, window, object).data());
  if (!layout_ || error == kFailed) return decision_.set(object, window, error);
  const LayoutStage::Fit fit = layout_->best(image_, window, object);
  decision_.set(object, window, layout_->passes(object, fit) ? fit.error : kFailed, fit.at);
}

}  // namespace takt::object_detection
