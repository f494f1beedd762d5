// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/cooccurrence_counter.hpp"

#include <algorithm>

#include "nodes/object_detection/cooccurrence_kernel.hpp"

namespace takt::object_detection {
namespace {

constexpr size_t kMargin = 32;
static_assert(kMargin >= kMaxDistance);
constexpr uint8_t kNoColour = 255;

/// Half the run of a disc's pixels in the row `dy` from its centre: round(sqrt(dx^2 + dy^2)) <= k, that is dx^2 + dy^2
/// <= k^2 + k, in whole numbers.
int half_width(int k, int dy) {
  int w = 0;
  while ((w + 1) * (w + 1) + dy * dy <= k * k + k) ++w;
  return w;
}

}  // namespace

CooccurrenceCounter::CooccurrenceCounter(int side, int distances) : side_(side), distances_(distances) {
  const auto rows = static_cast<size_t>(side), widths = static_cast<size_t>(distances) + 1;
  width_ = (rows + kPixelBlock - 1) / kPixelBlock * kPixelBlock;
  stride_ = width_ + 2 * kMargin;
  for (int k = 1; k <= distances; ++k)
    for (int dy = 1; dy <= k; ++dy)
      run_of_.push_back((static_cast<size_t>(dy) * widths + static_cast<size_t>(half_width(k, dy))) * width_);
  colours_.assign(rows * stride_, kNoColour);
  runs_.resize(rows * widths * width_);
  present_.resize(rows);
  sums_.resize(static_cast<size_t>(kMaxColours) * static_cast<size_t>(distances) * kPartialSums);
}

void CooccurrenceCounter::count(const uint8_t* colour, int colours, uint32_t* count) {
  std::fill_n(count, pair_bins(colours, distances_), 0u);
  const uint32_t present = load(colour, colours);
  const auto distances = static_cast<size_t>(distances_);
  for (int b = 0; b < colours; ++b) {
    if ((present >> b & 1) == 0) continue;
    count_around(static_cast<uint8_t>(b));
    const uint64_t* sum = sums_.data();
    for (int a = 0; a < colours; ++a) {
      uint32_t* bins = count + pair_bin(std::min(a, b), std::max(a, b), 1, colours, distances_);
      for (size_t k = 0; k < distances; ++k)
        for (size_t i = 0; i < kPartialSums; ++i) bins[k] += static_cast<uint32_t>(*sum++);
    }
  }
}

/// Returns the colours that there are, one bit each.
uint32_t CooccurrenceCounter::load(const uint8_t* colour, int colours) {
  uint32_t all = 0;
  for (size_t y = 0; y < present_.size(); ++y) {
    uint8_t* row = colours_.data() + y * stride_ + kMargin;
    uint32_t present = 0;
    for (int x = 0; x < side_; ++x) {
      const uint8_t c = *colour++;
      const bool counts = c < colours;
      row[x] = counts ? c : kNoColour;
      present |= static_cast<uint32_t>(counts) << (c & 31);
    }
    present_[y] = present;
    all |= present;
  }
  return all;
}

void CooccurrenceCounter::count_around(uint8_t b) {
  const size_t runs_of_row = (static_cast<size_t>(distances_) + 1) * width_;
  for (size_t y = 0; y < present_.size(); ++y)
    run_lengths(colours_.data() + y * stride_ + kMargin, b, width_, distances_, runs_.data() + y * runs_of_row);
  std::fill(sums_.begin(), sums_.end(), uint64_t{0});
  for (size_t y = 0; y < present_.size(); ++y) {
    const auto below = static_cast<int>(present_.size() - 1 - y);
    const auto reached = present_.begin() + static_cast<ptrdiff_t>(y);
    if (std::none_of(reached, reached + std::min(below, distances_) + 1,
                     [b](uint32_t present) { return (present >> b & 1) != 0; }))
      continue;
    add_rings({colours_.data() + y * stride_ + kMargin, width_, b, present_[y], distances_, below,
               runs_.data() + y * runs_of_row, run_of_.data()},
              sums_.data());
  }
}

}  // namespace takt::object_detection
