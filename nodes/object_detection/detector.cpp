// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/detector.hpp"

#include <algorithm>
#include <stdexcept>

namespace takt::object_detection {
namespace {

SearchGrid grid_for(int width, int height, std::span<const DatabaseObject> database, int window_px) {
  if (database.empty() || database[0].views.empty()) throw std::invalid_argument("the object database is empty");
  return make_search_grid(width, height, database[0].views[0].side_px, window_px);
}

Histogram histogram_of(ImageView<const uint8_t> view, Stage stage, const DetectorParameters& p,
                       const OrientationBins& orientations) {
  switch (stage) {
    case Stage::colour: return colour_histogram(view, p.bins);
    case Stage::orientation: return orientation_histogram(view, orientations);
    case Stage::cooccurrence: break;
  }
  return cooccurrence_histogram(view, p.pairs);
}

}  // namespace

/// A view's own threshold goes before the object's, and that before the automatic one.
std::array<Detector::StageReferences, kStages> Detector::references_of(std::span<const DatabaseObject> database,
                                                                       const DetectorParameters& p) {
  const OrientationBins orientations(p.orientations);
  std::array<StageReferences, kStages> stages;
  for (size_t s = 0; s <= static_cast<size_t>(p.last); ++s) {
    const double cap = s > 0 ? kLaterStagesCap : p.last == Stage::colour ? kThresholdCap : kColourBeforeOthersCap;
    for (const DatabaseObject& object : database) {
      auto& views = stages[s].histograms.emplace_back();
      for (const ReferenceView& view : object.views)
        views.push_back(histogram_of(view.view(), static_cast<Stage>(s), p, orientations));
      const double of_object = object.thresholds[s].value_or(automatic_threshold(views, p.tolerance, cap));
      auto& limits = stages[s].limits.emplace_back();
      for (size_t r = 0; r < views.size(); ++r)
        limits.push_back({views[r].mass, p.threshold_scale * object.views[r].thresholds[s].value_or(of_object)});
    }
  }
  return stages;
}

Detector::Detector(int image_width, int image_height, std::span<const DatabaseObject> database,
                   const DetectorParameters& p)
    : grid_(grid_for(image_width, image_height, database, p.window_px)),
      last_(p.last),
      references_(references_of(database, p)),
      colour_(grid_, p.bins, references(Stage::colour).histograms),
      decision_(grid_, database.size()),
      undecided_(static_cast<size_t>(grid_.windows())) {
  for (const StageReferences& stage : references_) limits_.emplace_back(stage.limits);
  if (p.last >= Stage::orientation)
    orientation_.emplace(grid_, OrientationBins(p.orientations), references(Stage::orientation).histograms);
  if (p.last >= Stage::cooccurrence) {
    cooccurrence_.emplace(grid_, p.pairs, references(Stage::cooccurrence).histograms);
    candidates_.reserve(static_cast<size_t>(grid_.windows()) * database.size());
  }
}

bool Detector::begin(ImageView<const uint8_t> bgr) {
  if (bgr.width != grid_.image_width || bgr.height != grid_.image_height || bgr.channels != 3) return false;
  image_ = bgr;
  colour_.begin(bgr, first_row_);
  if (orientation_) orientation_->begin(bgr);
  decision_.clear();
  return true;
}

void Detector::search_row() {
  const auto columns = static_cast<size_t>(grid_.columns);
  const size_t first = static_cast<size_t>(colour_.search_row()) * columns;
  for (size_t window = first; window < first + columns; ++window) {
    const uint16_t* missing = colour_.missing().data() + window * colour_.references();
    bool there = false;
    for (size_t object = 0; object < decision_.objects(); ++object) {
      float error = limits_[0].error(object, missing);
      missing += references(Stage::colour).histograms[object].size();
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

void Detector::gather_candidates() {
  candidates_.clear();
  if (!cooccurrence_) return;
  for (size_t object = 0; object < decision_.objects(); ++object) {
    const std::span<const float> errors = decision_.errors(object);
    for (size_t window = 0; window < errors.size(); ++window)
      if (errors[window] < kFailed)
        candidates_.push_back({errors[window], static_cast<uint32_t>(window), static_cast<uint32_t>(object)});
  }
  std::make_heap(candidates_.begin(), candidates_.end(), Candidate::worse);
}

void Detector::decide_best_candidate() {
  std::pop_heap(candidates_.begin(), candidates_.end(), Candidate::worse);
  const Candidate best = candidates_.back();
  candidates_.pop_back();
  const auto missing = cooccurrence_->missing(image_, best.window, best.object);
  decision_.set(best.object, best.window, limits_[2].error(best.object, missing.data()));
}

void Detector::end() {
  first_row_ = searched_rows_ == grid_.rows ? 0 : (first_row_ + searched_rows_) % grid_.rows;
  std::fill(undecided_.begin(), undecided_.end(), uint8_t{0});
  for (const Candidate& left : candidates_) {
    decision_.set(left.object, left.window, kFailed);
    undecided_[left.window] = 1;
  }
}

float Detector::searched() const {
  const auto undecided = std::count(undecided_.begin(), undecided_.end(), 1);
  return static_cast<float>(searched_rows_ * grid_.columns - undecided) / static_cast<float>(grid_.windows());
}

}  // namespace takt::object_detection
