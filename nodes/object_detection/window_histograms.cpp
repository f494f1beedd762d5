// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/window_histograms.hpp"

#include <algorithm>
#include <array>

#include "nodes/object_detection/histogram_kernels.hpp"

namespace takt::object_detection {
namespace {

/// Where windows begin and end, each place once.
template <class Origin>
std::vector<int> edges_of(int windows, int window_px, const Origin& origin) {
  std::vector<int> edges;
  for (int i = 0; i < windows; ++i) {
    edges.push_back(origin(i));
    edges.push_back(origin(i) + window_px);
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

size_t place_of(const std::vector<int>& edges, int at) {
  return static_cast<size_t>(std::lower_bound(edges.begin(), edges.end(), at) - edges.begin());
}

size_t padded_slots(size_t slots) { return (slots + kLaneBlock - 1) / kLaneBlock * kLaneBlock; }

}  // namespace

WindowHistograms::WindowHistograms(const SearchGrid& grid, size_t slots) : grid_(grid), slots_(padded_slots(slots)) {
  x_edges_ = edges_of(grid.columns, grid.window_px, [&](int u) { return grid.x0(u); });
  y_edges_ = edges_of(grid.rows, grid.window_px, [&](int v) { return grid.y0(v); });
  for (int u = 0; u < grid.columns; ++u) {
    first_strip_.push_back(place_of(x_edges_, grid.x0(u)));
    end_strip_.push_back(place_of(x_edges_, grid.x0(u) + grid.window_px));
  }
  for (int v = 0; v < grid.rows; ++v) {
    first_band_.push_back(place_of(y_edges_, grid.y0(v)));
    end_band_.push_back(place_of(y_edges_, grid.y0(v) + grid.window_px));
    kept_bands_ = std::max(kept_bands_, end_band_.back() - first_band_.back());
  }
  int highest = 0;
  for (size_t i = 0; i + 1 < y_edges_.size(); ++i) highest = std::max(highest, y_edges_[i + 1] - y_edges_[i]);
  index_.resize(static_cast<size_t>(highest) * static_cast<size_t>(grid.image_width));
  strips_ = stereo::Buffer<uint16_t>(strips() * slots_);
  cells_ = stereo::Buffer<uint16_t>(kept_bands_ * strips_.size());
  window_ = stereo::Buffer<uint16_t>(slots_);
}

void WindowHistograms::forget(size_t first_band) {
  first_ = end_ = first_band;
  strips_.fill(0);
}

void WindowHistograms::go_to_row(int row) {
  u_ = 0;
  v_ = static_cast<size_t>(row);
  if (first_band_[v_] < first_) forget(first_band_[v_]);
}

void WindowHistograms::leave_bands_above() {
  for (; first_ < std::min(end_, first_band_[v_]); ++first_)
    subtract_counts(strips_.data(), cells(first_), strips_.size());
  if (end_ < first_band_[v_]) first_ = end_ = first_band_[v_];
}

/// Neighbouring pixels mostly fall into the same slot, where an increment waits for the one before it: strips are
/// counted abreast, each in a histogram of its own.
void WindowHistograms::count_band() {
  constexpr size_t kAbreast = 4;
  std::fill_n(cells(end_), strips_.size(), uint16_t{0});
  size_t strip = 0;
  for (; strip + kAbreast <= strips(); strip += kAbreast) count_strips<kAbreast>(strip);
  for (; strip < strips(); ++strip) count_strips<1>(strip);
  add_counts(strips_.data(), cells(end_), strips_.size());
}

template <size_t kAbreast>
void WindowHistograms::count_strips(size_t first) {
  std::array<size_t, kAbreast> width;
  for (size_t k = 0; k < kAbreast; ++k) width[k] = static_cast<size_t>(x_edges_[first + k + 1] - x_edges_[first + k]);
  const size_t common = *std::min_element(width.begin(), width.end());
  uint16_t* count = cells(end_) + first * slots_;
  const uint16_t* row = index_.data();
  for (int y = y_edges_[end_]; y < y_edges_[end_ + 1]; ++y, row += grid_.image_width) {
    std::array<const uint16_t*, kAbreast> slot;
    for (size_t k = 0; k < kAbreast; ++k) slot[k] = row + x_edges_[first + k];
    for (size_t x = 0; x < common; ++x)
      for (size_t k = 0; k < kAbreast; ++k) ++count[k * slots_ + slot[k][x]];
    for (size_t k = 0; k < kAbreast; ++k)
      for (size_t x = common; x < width[k]; ++x) ++count[k * slots_ + slot[k][x]];
  }
}

std::span<const uint16_t> WindowHistograms::slide() {
  const size_t u = u_++;
  if (u == 0) window_.fill(0);
  const size_t gone = u == 0 ? first_strip_[0] : first_strip_[u - 1], come = u == 0 ? gone : end_strip_[u - 1];
  for (size_t i = gone; i < first_strip_[u]; ++i) subtract_counts(window_.data(), strips_.data() + i * slots_, slots_);
  for (size_t i = come; i < end_strip_[u]; ++i) add_counts(window_.data(), strips_.data() + i * slots_, slots_);
  return {window_.data(), slots_};
}

}  // namespace takt::object_detection
