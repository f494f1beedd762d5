// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/window_histograms.hpp"

#include <algorithm>

namespace takt::object_detection {

WindowHistograms::WindowHistograms(const SearchGrid& grid, size_t slots) : grid_(grid), slots_(slots) {
  for (int u = 0; u < grid.columns; ++u) {
    edges_.push_back(grid.x0(u));
    edges_.push_back(grid.x0(u) + grid.window_px);
  }
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  const auto strip_at = [&](int x) {
    return static_cast<size_t>(std::lower_bound(edges_.begin(), edges_.end(), x) - edges_.begin());
  };
  for (int u = 0; u < grid.columns; ++u) {
    first_strip_.push_back(strip_at(grid.x0(u)));
    end_strip_.push_back(strip_at(grid.x0(u) + grid.window_px));
  }
  strips_.resize((edges_.size() - 1) * slots);
  window_.resize(slots);
}

void WindowHistograms::begin(const uint16_t* index, int row) {
  index_ = index;
  u_ = 0;
  v_ = row;
  std::fill(strips_.begin(), strips_.end(), uint16_t{0});
  count_rows(grid_.y0(row), grid_.y0(row) + grid_.window_px, 1);
}

void WindowHistograms::skip_rest_of_row() {
  begin_row_if_due();
  u_ = grid_.columns;
}

void WindowHistograms::begin_row_if_due() {
  if (u_ < grid_.columns) return;
  const int gone = grid_.y0(v_), kept = grid_.y0(v_ + 1);
  count_rows(gone, kept, static_cast<uint16_t>(-1));
  count_rows(gone + grid_.window_px, kept + grid_.window_px, 1);
  u_ = 0;
  ++v_;
}

std::span<const uint16_t> WindowHistograms::next() {
  begin_row_if_due();
  const auto u = static_cast<size_t>(u_++);
  if (u == 0) {
    std::fill(window_.begin(), window_.end(), uint16_t{0});
    change_window(first_strip_[0], end_strip_[0], true);
  } else {
    change_window(first_strip_[u - 1], first_strip_[u], false);
    change_window(end_strip_[u - 1], end_strip_[u], true);
  }
  return window_;
}

/// Adds `change` (modulo 2^16, so that it may be -1) for every pixel of the rows.
void WindowHistograms::count_rows(int from, int to, uint16_t change) {
  for (int y = from; y < to; ++y) {
    const uint16_t* row = index_ + static_cast<size_t>(y) * static_cast<size_t>(grid_.image_width);
    uint16_t* strip = strips_.data();
    for (size_t i = 0; i + 1 < edges_.size(); ++i, strip += slots_)
      for (int x = edges_[i]; x < edges_[i + 1]; ++x) strip[row[x]] = static_cast<uint16_t>(strip[row[x]] + change);
  }
}

void WindowHistograms::change_window(size_t from_strip, size_t to_strip, bool add) {
  for (size_t i = from_strip; i < to_strip; ++i) {
    const uint16_t* strip = strips_.data() + i * slots_;
    uint16_t* window = window_.data();
    if (add)
      for (size_t k = 0; k < slots_; ++k) window[k] = static_cast<uint16_t>(window[k] + strip[k]);
    else
      for (size_t k = 0; k < slots_; ++k) window[k] = static_cast<uint16_t>(window[k] - strip[k]);
  }
}

}  // namespace takt::object_detection
