// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/stage_errors.hpp"

#include <algorithm>

namespace takt::object_detection {

StageErrors::StageErrors(Stage stage, const SearchGrid& grid, const std::vector<Histogram>& views,
                         const DetectorParameters& p)
    : grid_(grid) {
  for (const Histogram& view : views) masses_.push_back(std::max(1u, view.mass));
  const std::span one(&views, 1);
  if (stage == Stage::colour) colour_.emplace(grid, p.bins, one);
  if (stage == Stage::orientation) orientation_.emplace(grid, OrientationBins(p.orientations), one);
  if (stage == Stage::cooccurrence) cooccurrence_.emplace(grid, p.pairs, one);
}

template <class Mass>
float StageErrors::least(std::span<const Mass> missing) const {
  float least = 1;
  for (size_t r = 0; r < masses_.size(); ++r)
    least = std::min(least, static_cast<float>(missing[r]) / static_cast<float>(masses_[r]));
  return least;
}

std::vector<float> StageErrors::run(ImageView<const uint8_t> bgr) {
  std::vector<float> error;
  if (colour_) colour_->run(bgr);
  if (orientation_) orientation_->begin(bgr);
  for (size_t window = 0; window < static_cast<size_t>(grid_.windows()); ++window) {
    if (colour_) error.push_back(least(colour_->missing().subspan(window * masses_.size(), masses_.size())));
    if (orientation_) {
      orientation_->go_to(window);
      error.push_back(least(orientation_->missing(0)));
    }
    if (cooccurrence_) error.push_back(least(cooccurrence_->missing(bgr, window, 0)));
  }
  return error;
}

}  // namespace takt::object_detection
