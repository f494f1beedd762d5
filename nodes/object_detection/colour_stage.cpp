// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/colour_stage.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

namespace takt::object_detection {
namespace {

bool used(const std::vector<Histogram>& views, size_t bin) {
  return std::any_of(views.begin(), views.end(), [bin](const Histogram& view) { return view.count[bin] > 0; });
}

}  // namespace

ColourStage::ColourStage(const SearchGrid& grid, ColourBins bins, std::span<const std::vector<Histogram>> objects)
    : grid_(grid),
      bins_(bins),
      slot_of_bin_(kColourBins),
      slots_(assign_slots(objects)),
      references_(slots_, by_slot(objects)),
      windows_(grid, slots_),
      missing_(static_cast<size_t>(grid.windows()) * references()) {}

/// Returns how many. Bins that the same objects use stand together: so an object's lie in few blocks.
size_t ColourStage::assign_slots(std::span<const std::vector<Histogram>> objects) {
  std::map<std::vector<bool>, std::vector<size_t>> bins_of;  // by who uses them
  for (size_t bin = 0; bin < kColourBins; ++bin) {
    std::vector<bool> users;
    for (const auto& views : objects) users.push_back(used(views, bin));
    bins_of[users].push_back(bin);
  }
  const std::vector<bool> nobody(objects.size());
  size_t slots = 0;
  for (const auto& [users, bins] : bins_of)
    if (users != nobody)
      for (const size_t bin : bins) slot_of_bin_[bin] = static_cast<uint16_t>(slots++);
  for (const size_t bin : bins_of[nobody]) slot_of_bin_[bin] = static_cast<uint16_t>(slots);
  return slots + 1;
}

std::vector<std::vector<ByteReferences::Counts>> ColourStage::by_slot(
    std::span<const std::vector<Histogram>> objects) const {
  std::vector<std::vector<ByteReferences::Counts>> counts;
  for (const auto& views : objects) {
    auto& references = counts.emplace_back();
    for (const Histogram& view : views) {
      if (view.mass == 0 || view.mass > UINT16_MAX)
        throw std::invalid_argument("a reference has " + std::to_string(view.mass) + " pixels, must have 1 .. 65535");
      auto& reference = references.emplace_back(slots_);
      for (size_t bin = 0; bin < kColourBins; ++bin)
        if (view.count[bin] > 0) reference[slot_of_bin_[bin]] = static_cast<uint16_t>(view.count[bin]);
    }
  }
  return counts;
}

void ColourStage::index_rows(int from, int to, uint16_t* index) const {
  const auto width = static_cast<size_t>(grid_.image_width);
  for (int y = from; y < to; ++y, index += width) {
    colour_bins(image_.row(y), width, bins_, index);
    for (size_t x = 0; x < width; ++x) index[x] = slot_of_bin_[index[x]];
  }
}

void ColourStage::run(ImageView<const uint8_t> bgr) {
  begin(bgr, 0);
  for (int row = 0; row < grid_.rows; ++row) search_row();
}

void ColourStage::begin(ImageView<const uint8_t> bgr, int first_row, std::span<const uint8_t> wanted) {
  image_ = bgr;
  wanted_ = wanted;
  std::fill(missing_.begin(), missing_.end(), kNotSearched);
  row_ = first_row;
  windows_.begin();
}

int ColourStage::search_row() {
  if (row_ == grid_.rows) row_ = 0;
  windows_.go_to_row(row_);
  const auto columns = static_cast<size_t>(grid_.columns), first = static_cast<size_t>(row_) * columns;
  const auto left_out = [&](size_t window) { return !wanted_.empty() && wanted_[window] == 0; };
  size_t end = first + columns;  // of what is wanted of the row
  while (end > first && left_out(end - 1)) --end;
  for (size_t window = first; window < end; ++window) {
    const std::span<const uint16_t> histogram =
        windows_.next([this](int from, int to, uint16_t* index) { index_rows(from, to, index); });
    if (left_out(window)) continue;
    references_.take(histogram);
    uint16_t* out = missing_.data() + window * references();
    for (size_t object = 0; object < references_.objects(); out += references_.references(object++))
      references_.missing(object, out);
  }
  return row_++;
}

}  // namespace takt::object_detection
