// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cell_sort.hpp"

#include <algorithm>
#include <bit>

namespace takt::cloud {
namespace {

constexpr double kShortestRow = 6;
// Strides of a scene too vast for one bucket per cell; the buckets must not be fewer for these to keep rows apart.
constexpr uint32_t kVastRow = 1031, kVastLayer = 65537;
constexpr size_t kFewestBuckets = size_t{1} << 18;

}  // namespace

CellSort::CellSort(size_t capacity)
    : sorted_(capacity + kReadAhead),
      bucket_(capacity),
      start_(std::max(kFewestBuckets, std::bit_ceil(2 * capacity)) + 2) {}

CellLayout CellSort::layout(const double (&cells)[3], size_t most_buckets) const {
  const double row = std::max(cells[0], kShortestRow), all = row * cells[1] * cells[2];
  const size_t most = std::clamp(std::bit_ceil(most_buckets), kFewestBuckets, start_.size() - 2);
  if (all > static_cast<double>(most)) return {kVastRow, kVastLayer, static_cast<uint32_t>(most), true};
  return {static_cast<uint32_t>(row), static_cast<uint32_t>(row * cells[1]), static_cast<uint32_t>(all), false};
}

void CellSort::clear(const CellLayout& layout) { std::fill_n(start_.begin(), layout.buckets + 2, 0u); }

// start_[b] is where bucket b ends, and moves down to where it starts.
void CellSort::scatter(std::span<const Point> points, const CellLayout& layout) {
  uint32_t sum = 0;
  for (size_t b = 0; b < layout.buckets + 2; ++b) start_[b] = sum += start_[b];
  constexpr size_t kAhead = 32;  // neighbours in the cloud may go far from one another: their places are fetched ahead
  for (size_t i = points.size(); i-- > 0;) {
    if (i >= kAhead) __builtin_prefetch(&sorted_[start_[bucket_[i - kAhead]] - 1], 1);
    sorted_[--start_[bucket_[i]]] = {points[i].x, points[i].y, points[i].z, static_cast<uint32_t>(i)};
  }
}

}  // namespace takt::cloud
