// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/orientation_stage.hpp"

#include <algorithm>

namespace takt::object_detection {
namespace {

/// One slot behind the orientations takes the pixels without one.
size_t slots_of(const OrientationBins& bins) { return static_cast<size_t>(bins.count()) + 1; }

std::vector<std::vector<ByteReferences::Counts>> by_slot(std::span<const std::vector<Histogram>> objects) {
  std::vector<std::vector<ByteReferences::Counts>> counts;
  for (const auto& views : objects) {
    auto& references = counts.emplace_back();
    for (const Histogram& view : views) references.emplace_back(view.count.begin(), view.count.end());
  }
  return counts;
}

}  // namespace

OrientationStage::OrientationStage(const SearchGrid& grid, const OrientationBins& bins,
                                   std::span<const std::vector<Histogram>> objects)
    : grid_(grid), bins_(bins), references_(slots_of(bins), by_slot(objects)), windows_(grid, slots_of(bins)) {
  values_.resize(OrientationBins::kValueRows * static_cast<size_t>(grid.image_width));
  size_t most = 0;
  for (const auto& views : objects) most = std::max(most, views.size());
  missing_.resize(most);
}

void OrientationStage::begin(ImageView<const uint8_t> bgr) {
  image_ = bgr;
  row_ = -1;
  windows_.begin();
}

void OrientationStage::go_to(size_t window) {
  const auto columns = static_cast<size_t>(grid_.columns);
  const auto row = static_cast<int>(window / columns);
  if (row != row_) {
    windows_.go_to_row(row);
    row_ = row;
    next_ = static_cast<size_t>(row) * columns;
  }
  std::span<const uint16_t> histogram;
  for (; next_ <= window; ++next_)
    histogram = windows_.next(
        [this](int from, int to, uint16_t* index) { bins_.rows(image_, from, to, values_.data(), index); });
  references_.take(histogram);
}

std::span<const uint16_t> OrientationStage::missing(size_t object) {
  references_.missing(object, missing_.data());
  return std::span(missing_).first(references_.references(object));
}

}  // namespace takt::object_detection
