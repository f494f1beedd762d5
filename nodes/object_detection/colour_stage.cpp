// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/colour_stage.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "nodes/object_detection/intersection_kernel.hpp"

namespace takt::object_detection {
namespace {

bool used(const std::vector<Histogram>& views, size_t bin) {
  return std::any_of(views.begin(), views.end(), [bin](const Histogram& view) { return view.count[bin] > 0; });
}

}  // namespace

ColourStage::ColourStage(const SearchGrid& grid, ColourBins bins, std::span<const std::vector<Histogram>> objects)
    : grid_(grid), bins_(bins), slot_of_bin_(kColourBins) {
  uint16_t slots = 0;
  std::vector<size_t> unused;
  for (size_t bin = 0; bin < kColourBins; ++bin) {
    if (std::any_of(objects.begin(), objects.end(), [bin](const auto& views) { return used(views, bin); }))
      slot_of_bin_[bin] = slots++;
    else unused.push_back(bin);
  }
  for (const size_t bin : unused) slot_of_bin_[bin] = slots;
  size_t widest = 0;
  for (const auto& views : objects) {
    objects_.push_back(gather(views));
    references_ += views.size();
    widest = std::max(widest, objects_.back().slots.size());
  }
  windows_.emplace(grid, size_t{slots} + 1);
  index_.resize(static_cast<size_t>(grid.image_width) * static_cast<size_t>(grid.image_height));
  gathered_.resize(widest);
  missing_.resize(static_cast<size_t>(grid.windows()) * references_);
}

ColourStage::ObjectBins ColourStage::gather(const std::vector<Histogram>& views) const {
  ObjectBins object;
  std::vector<size_t> bins;
  for (size_t bin = 0; bin < kColourBins; ++bin)
    if (used(views, bin)) bins.push_back(bin);
  for (const size_t bin : bins) object.slots.push_back(slot_of_bin_[bin]);
  object.slots.resize((bins.size() + kLaneBlock - 1) / kLaneBlock * kLaneBlock);  // a reference lacks nothing there
  for (const Histogram& view : views) {
    if (view.mass == 0 || view.mass > UINT16_MAX)
      throw std::invalid_argument("a reference has " + std::to_string(view.mass) + " pixels, must have 1 .. 65535");
    const size_t row = object.rows.size();
    object.rows.resize(row + object.slots.size());
    for (size_t i = 0; i < bins.size(); ++i) object.rows[row + i] = static_cast<uint16_t>(view.count[bins[i]]);
  }
  object.references = views.size();
  return object;
}

void ColourStage::index_image(ImageView<const uint8_t> bgr) {
  const auto width = static_cast<size_t>(grid_.image_width);
  for (int y = 0; y < grid_.image_height; ++y) {
    uint16_t* row = index_.data() + static_cast<size_t>(y) * width;
    colour_bins(bgr.row(y), width, bins_, row);
    for (size_t x = 0; x < width; ++x) row[x] = slot_of_bin_[row[x]];
  }
}

void ColourStage::run(ImageView<const uint8_t> bgr) {
  begin(bgr, 0);
  for (int row = 0; row < grid_.rows; ++row) search_row();
}

void ColourStage::begin(ImageView<const uint8_t> bgr, int first_row, std::span<const uint8_t> wanted) {
  wanted_ = wanted;
  index_image(bgr);
  std::fill(missing_.begin(), missing_.end(), kNotSearched);
  row_ = first_row;
  windows_->begin(index_.data(), row_);
}

int ColourStage::search_row() {
  if (row_ == grid_.rows) windows_->begin(index_.data(), row_ = 0);
  const auto columns = static_cast<size_t>(grid_.columns), first = static_cast<size_t>(row_) * columns;
  const auto left_out = [&](size_t window) { return !wanted_.empty() && wanted_[window] == 0; };
  size_t end = first + columns;  // of what is wanted of the row
  while (end > first && left_out(end - 1)) --end;
  for (size_t window = first; window < end; ++window) {
    const std::span<const uint16_t> histogram = windows_->next();
    if (left_out(window)) continue;
    uint16_t* out = missing_.data() + window * references_;
    for (const ObjectBins& object : objects_) {
      const size_t count = object.slots.size();
      for (size_t i = 0; i < count; ++i) gathered_[i] = histogram[object.slots[i]];
      missing_masses(gathered_.data(), object.rows.data(), count, object.references, out);
      out += object.references;
    }
  }
  if (end < first + columns) windows_->skip_rest_of_row();
  return row_++;
}

}  // namespace takt::object_detection
