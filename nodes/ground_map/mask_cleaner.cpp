// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/mask_cleaner.hpp"

#include <algorithm>
#include <cstring>

namespace takt::ground_map {

MaskCleaner::MaskCleaner(int width, int height, int mean_size)
    : width_(width),
      height_(height),
      waiting_ground_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      sums_(static_cast<size_t>(width)),
      within_(static_cast<size_t>(width)) {
  // Every run is put there once, and a row has at most one run for two pixels.
  runs_.reserve(static_cast<size_t>(height) * (static_cast<size_t>(width) / 2 + 1));
  columns_.reserve(static_cast<size_t>(width + 2 * (std::max(kLargest, mean_size) / 2)));
  tune(mean_size);
}

void MaskCleaner::tune(int mean_size) {
  radius_ = mean_size / 2;
  columns_.resize(static_cast<size_t>(width_ + 2 * radius_));
  for (int x = 0; x < width_; ++x)
    within_[static_cast<size_t>(x)] =
        static_cast<int16_t>(std::min(x + radius_, width_ - 1) - std::max(x - radius_, 0) + 1);
}

void MaskCleaner::clean(ImageView<const uint8_t> raw, const ReferenceArea& area, ImageView<uint8_t> mask) {
  average(raw);
  for (int y = 0; y < height_; ++y) std::fill_n(mask.row(y), width_, uint8_t{0});
  for (const RowSpan& span : area.spans()) {
    reach({span.y, span.first, span.last}, mask);
    while (!runs_.empty()) {
      const Run run = runs_.back();
      runs_.pop_back();
      if (run.y > 0) reach({run.y - 1, run.first, run.last}, mask);
      if (run.y + 1 < height_) reach({run.y + 1, run.first, run.last}, mask);
    }
  }
}

// Sums of columns, moved down a row at a time, then of neighbouring columns; none is above 31 * 31.
void MaskCleaner::average(ImageView<const uint8_t> raw) {
  std::fill(columns_.begin(), columns_.end(), int16_t{0});
  int16_t* columns = columns_.data() + radius_;  // zeros before and behind
  const auto change = [&](int y, int sign) {
    const uint8_t* row = raw.row(y);
    for (int x = 0; x < width_; ++x) columns[x] = static_cast<int16_t>(columns[x] + sign * row[x]);
  };
  for (int y = 0; y < std::min(radius_, height_); ++y) change(y, 1);
  for (int y = 0; y < height_; ++y) {
    if (y + radius_ < height_) change(y + radius_, 1);
    if (y > radius_) change(y - radius_ - 1, -1);
    const int rows = std::min(y + radius_, height_ - 1) - std::max(y - radius_, 0) + 1;
    std::copy_n(columns - radius_, width_, sums_.data());
    for (int k = 1 - radius_; k <= radius_; ++k)
      for (int x = 0; x < width_; ++x)
        sums_[static_cast<size_t>(x)] = static_cast<int16_t>(sums_[static_cast<size_t>(x)] + columns[x + k]);
    const int16_t *sums = sums_.data(), *within = within_.data();
    uint8_t* out = row(y);
    for (int x = 0, n = width_; x < n; ++x)
      out[x] = static_cast<int16_t>(2 * sums[x]) > static_cast<int16_t>(rows * within[x]);
  }
}

// Every run of waiting ground that has a pixel in `along` goes to the mask as a whole, and is waited for no longer.
void MaskCleaner::reach(const Run& along, ImageView<uint8_t> mask) {
  uint8_t* ground = row(along.y);
  const auto find = [&](int from, int to, int value) {  // `to` if there is none
    const void* found = from < to ? std::memchr(ground + from, value, static_cast<size_t>(to - from)) : nullptr;
    return found ? static_cast<int>(static_cast<const uint8_t*>(found) - ground) : to;
  };
  for (int at = find(along.first, along.last, 1); at < along.last; at = find(at, along.last, 1)) {
    int first = at;
    while (first > 0 && ground[first - 1]) --first;
    const int last = find(at, width_, 0);
    std::fill(ground + first, ground + last, uint8_t{0});
    std::fill(mask.row(along.y) + first, mask.row(along.y) + last, uint8_t{255});
    runs_.push_back({along.y, first, last});  // never beyond the capacity taken in the constructor
    at = last;
  }
}

}  // namespace takt::ground_map
