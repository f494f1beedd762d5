// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/cooccurrence_stage.hpp"

#include <algorithm>

#include "nodes/cuda/quicker.hpp"
#include "nodes/object_detection/histogram_kernels.hpp"

namespace takt::object_detection {

CooccurrenceStage::CooccurrenceStage(const SearchGrid& grid, const PairBins& bins,
                                     std::span<const std::vector<Histogram>> objects)
    : grid_(grid), bins_(bins), counter_(grid.window_px, bins.distances) {
  size_t widest = 0, most = 0;
  for (const auto& views : objects) {
    objects_.push_back(gather(views));
    widest = std::max(widest, objects_.back().bins);
    most = std::max(most, views.size());
  }
  colours_.resize(static_cast<size_t>(grid.window_px) * static_cast<size_t>(grid.window_px));
  count_.resize(widest);
  missing_.resize(most);
}

PairReferences CooccurrenceStage::gather(const std::vector<Histogram>& views) const {
  const auto bin = [&](int a, int b, int k) {
    return pair_bin(std::min(a, b), std::max(a, b), k, bins_.colours, bins_.distances);
  };
  const auto has = [&](int a) {
    for (const Histogram& view : views)
      for (int b = 0; b < bins_.colours; ++b)
        for (int k = 1; k <= bins_.distances; ++k)
          if (view.count[bin(a, b, k)] > 0) return true;
    return false;
  };
  PairReferences references;
  std::vector<uint8_t>& used = references.colour_of_slot;
  for (int a = 0; a < bins_.colours; ++a)
    if (has(a)) used.push_back(static_cast<uint8_t>(a));
  references.slot_of_colour.assign(static_cast<size_t>(bins_.colours), static_cast<uint8_t>(used.size()));
  for (size_t slot = 0; slot < used.size(); ++slot) references.slot_of_colour[used[slot]] = static_cast<uint8_t>(slot);
  references.bins = (pair_bins(references.colours(), bins_.distances) + kLaneBlock - 1) / kLaneBlock * kLaneBlock;
  references.count = views.size();
  for (const Histogram& view : views) {
    std::vector<uint32_t> row;
    for (size_t a = 0; a < used.size(); ++a)
      for (size_t b = a; b < used.size(); ++b)
        for (int k = 1; k <= bins_.distances; ++k) row.push_back(view.count[bin(used[a], used[b], k)]);
    row.resize(references.bins);  // a reference lacks nothing there
    references.rows.insert(references.rows.end(), row.begin(), row.end());
  }
  return references;
}

void CooccurrenceStage::use(const cuda::CardUse& card) {
  card_ = std::make_unique<CudaCooccurrences>(grid_, bins_, objects_, card);
}

void CooccurrenceStage::count_ahead(ImageView<const uint8_t> bgr, std::span<const WindowOfObject> questions) {
  if (card_) (void)card_->find(bgr, questions);  // what it does not find, missing() counts
}

bool CooccurrenceStage::card_is_quicker(const Clock& clock) {
  constexpr size_t kTried = 8;  // about as many as the first two stages leave
  const std::vector<uint8_t> pixels =
      cuda::noise(size_t{3} * static_cast<size_t>(grid_.image_width) * static_cast<size_t>(grid_.image_height));
  const ImageView<const uint8_t> image(pixels.data(), grid_.image_width, grid_.image_height, 3);
  std::vector<WindowOfObject> questions;
  const auto windows = static_cast<size_t>(grid_.windows());
  for (size_t i = 0; i < std::min(kTried, windows); ++i)
    questions.push_back({i * windows / std::min(kTried, windows), i % objects_.size()});
  return cuda::is_quicker(
      clock, [&] { return card_->find(image, questions); },
      [&] {
        for (const WindowOfObject& question : questions) count(image, question.window, question.object);
      });
}

std::span<const uint32_t> CooccurrenceStage::missing(ImageView<const uint8_t> bgr, size_t window, size_t object) {
  if (card_)
    if (const auto known = card_->missing(window, object); !known.empty()) return known;
  return count(bgr, window, object);
}

std::span<const uint32_t> CooccurrenceStage::count(ImageView<const uint8_t> bgr, size_t window, size_t object) {
  const PairReferences& references = objects_[object];
  const auto u = static_cast<int>(window) % grid_.columns, v = static_cast<int>(window) / grid_.columns;
  const auto side = static_cast<size_t>(grid_.window_px);
  for (size_t y = 0; y < side; ++y) {
    uint8_t* row = colours_.data() + y * side;
    pair_colours(&bgr.at(grid_.x0(u), grid_.y0(v) + static_cast<int>(y)), side, bins_.colours, row);
    for (size_t x = 0; x < side; ++x) row[x] = references.slot_of_colour[row[x]];
  }
  counter_.count(colours_.data(), references.colours(), count_.data());
  missing_masses(count_.data(), references.rows.data(), references.bins, references.count, missing_.data());
  return std::span(missing_).first(references.count);
}

}  // namespace takt::object_detection
