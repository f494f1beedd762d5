// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/mask_cleaner.hpp"

#include <algorithm>

namespace takt::ground_map {

MaskCleaner::MaskCleaner(int width, int height, int mean_size)
    : width_(width),
      height_(height),
      radius_(mean_size / 2),
      smooth_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      columns_(static_cast<size_t>(width)) {
  // Every run is put there once, and a row has at most one run for two pixels.
  waiting_.reserve(static_cast<size_t>(height) * (static_cast<size_t>(width) / 2 + 1));
}

void MaskCleaner::clean(ImageView<const uint8_t> raw, const ReferenceArea& area, ImageView<uint8_t> mask) {
  average(raw);
  for (int y = 0; y < height_; ++y) std::fill_n(mask.row(y), width_, uint8_t{0});
  for (const RowSpan& span : area.spans())
    for (int x = span.first; x < span.last; ++x)
      if (smooth_row(span.y)[x] && !mask.at(x, span.y)) reach(x, span.y, mask);
}

// Sums of columns, moved down a row at a time, and of those a window moved along the row.
void MaskCleaner::average(ImageView<const uint8_t> raw) {
  std::fill(columns_.begin(), columns_.end(), 0);
  for (int y = 0; y < std::min(radius_, height_); ++y)
    for (int x = 0; x < width_; ++x) columns_[static_cast<size_t>(x)] += raw.row(y)[x];
  for (int y = 0; y < height_; ++y) {
    if (y + radius_ < height_) {
      const uint8_t* below = raw.row(y + radius_);
      for (int x = 0; x < width_; ++x) columns_[static_cast<size_t>(x)] += below[x];
    }
    if (y - radius_ > 0) {
      const uint8_t* above = raw.row(y - radius_ - 1);
      for (int x = 0; x < width_; ++x) columns_[static_cast<size_t>(x)] -= above[x];
    }
    const int rows = std::min(y + radius_, height_ - 1) - std::max(y - radius_, 0) + 1;
    uint8_t* out = smooth_.data() + static_cast<ptrdiff_t>(y) * width_;
    int sum = 0, within = 0;
    for (int x = 0; x < std::min(radius_, width_); ++x) sum += columns_[static_cast<size_t>(x)], within += rows;
    for (int x = 0; x < width_; ++x) {
      if (x + radius_ < width_) sum += columns_[static_cast<size_t>(x + radius_)], within += rows;
      if (x > radius_) sum -= columns_[static_cast<size_t>(x - radius_ - 1)], within -= rows;
      out[x] = 2 * sum > within;
    }
  }
}

// Marks the whole run around (x, y), then the runs above and below every run marked. No run waits twice, because it is
// marked when it is put there.
void MaskCleaner::reach(int x, int y, ImageView<uint8_t> mask) {
  const auto mark_run = [&](int at, int row) {
    const uint8_t* ground = smooth_row(row);
    int first = at, last = at + 1;
    while (first > 0 && ground[first - 1]) --first;
    while (last < width_ && ground[last]) ++last;
    std::fill(mask.row(row) + first, mask.row(row) + last, uint8_t{255});
    waiting_.push_back({row, first, last});  // never beyond the capacity taken in the constructor
    return last;
  };
  mark_run(x, y);
  while (!waiting_.empty()) {
    const Run run = waiting_.back();
    waiting_.pop_back();
    for (const int row : {run.y - 1, run.y + 1}) {
      if (row < 0 || row >= height_) continue;
      const uint8_t *ground = smooth_row(row), *marked = mask.row(row);
      for (int at = run.first; at < run.last; ++at)
        if (ground[at] && !marked[at]) at = mark_run(at, row);
    }
  }
}

}  // namespace takt::ground_map
