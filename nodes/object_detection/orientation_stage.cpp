// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/orientation_stage.hpp"

#include <algorithm>

#include "nodes/object_detection/intersection_kernel.hpp"

namespace takt::object_detection {
namespace {

/// One slot behind the orientations takes the pixels without one.
size_t slots_of(const OrientationBins& bins) {
  return (static_cast<size_t>(bins.count()) + kLaneBlock) / kLaneBlock * kLaneBlock;
}

}  // namespace

OrientationStage::OrientationStage(const SearchGrid& grid, const OrientationBins& bins,
                                   std::span<const std::vector<Histogram>> objects)
    : grid_(grid), bins_(bins), windows_(grid, slots_of(bins)) {
  const size_t slots = slots_of(bins);
  size_t most = 0;
  for (const auto& views : objects) {
    References& references = objects_.emplace_back();
    references.count = views.size();
    references.rows.resize(views.size() * slots);
    for (size_t r = 0; r < views.size(); ++r)
      std::copy(views[r].count.begin(), views[r].count.end(),
                references.rows.begin() + static_cast<ptrdiff_t>(r * slots));
    most = std::max(most, views.size());
  }
  const auto pixels = static_cast<size_t>(grid.image_width) * static_cast<size_t>(grid.image_height);
  values_.resize(pixels);
  index_.resize(pixels);
  missing_.resize(most);
}

void OrientationStage::begin(ImageView<const uint8_t> bgr) {
  image_ = bgr;
  prepared_ = false;
}

void OrientationStage::go_to(size_t window) {
  const auto columns = static_cast<size_t>(grid_.columns);
  const size_t row = window / columns;
  if (!prepared_) bins_.image(image_, values_.data(), index_.data());
  // To follow the windows into the next row costs less than a new start there; over more rows it costs more.
  const bool follows = prepared_ && row >= next_ / columns && row <= next_ / columns + 1;
  if (!follows) windows_.begin(index_.data(), static_cast<int>(row));
  if (!follows) next_ = row * columns;
  prepared_ = true;
  for (; next_ <= window; ++next_) histogram_ = windows_.next();
}

std::span<const uint16_t> OrientationStage::missing(size_t object) {
  const References& references = objects_[object];
  missing_masses(histogram_.data(), references.rows.data(), histogram_.size(), references.count, missing_.data());
  return std::span(missing_).first(references.count);
}

}  // namespace takt::object_detection
