// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/outlier_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace takt::cloud {
namespace {

constexpr uint32_t kNoBucket = UINT32_MAX;
// A cell is a little wider than the radius, so that rounding cannot put a neighbour two cells away.
constexpr double kCellMargin = 1.001;
// Strides of a scene too vast for one bucket per cell: all nine neighbouring rows stay at least three buckets apart.
constexpr uint32_t kVastRow = 1031, kVastLayer = 65537;

bool usable(const Point& p) {
  // Written so that NaN fails.
  return std::abs(p.x) <= kFarthest_m && std::abs(p.y) <= kFarthest_m && std::abs(p.z) <= kFarthest_m;
}

}  // namespace

int scaled_n_min(int n_min_full, size_t points, size_t points_full) {
  const double n = static_cast<double>(n_min_full) * static_cast<double>(points) / static_cast<double>(points_full);
  return std::max(1, static_cast<int>(std::lround(n)));
}

OutlierFilter::OutlierFilter(size_t capacity)
    : x_(capacity + kReadAhead),
      y_(capacity + kReadAhead),
      z_(capacity + kReadAhead),
      index_(capacity),
      bucket_(capacity),
      // 2^18 at least: the strides of a vast scene need the room.
      start_(std::bit_ceil(std::max<size_t>(capacity / 2, size_t{1} << 18)) + 1),
      pass_(capacity) {}

uint32_t OutlierFilter::bucket_of(const Point& p) const {
  const auto cell = [&](float v, int axis) {  // never negative: the origin lies below all points
    return static_cast<uint32_t>(
        static_cast<uint64_t>((static_cast<double>(v) - layout_.origin[axis]) * layout_.inverse_edge));
  };
  return (cell(p.x, 0) + cell(p.y, 1) * layout_.row + cell(p.z, 2) * layout_.layer) & layout_.mask;
}

size_t OutlierFilter::load(std::span<const Point> points, double radius_m) {
  float low[3] = {kFarthest_m, kFarthest_m, kFarthest_m}, high[3] = {-kFarthest_m, -kFarthest_m, -kFarthest_m};
  size_t used = 0;
  for (const Point& p : points) {
    if (!usable(p)) continue;
    ++used;
    const float v[3] = {p.x, p.y, p.z};
    for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], v[a]), high[a] = std::max(high[a], v[a]);
  }
  if (used == 0) return 0;
  const double edge = radius_m * kCellMargin;
  layout_.inverse_edge = 1 / edge;
  double cells[3];
  for (int a = 0; a < 3; ++a) {  // one empty cell on each side: no neighbour wraps around
    layout_.origin[a] = static_cast<double>(low[a]) - 1.5 * edge;
    cells[a] = std::floor((static_cast<double>(high[a]) - layout_.origin[a]) / edge) + 3;
  }
  const size_t buckets = start_.size() - 1;
  layout_.mask = static_cast<uint32_t>(buckets - 1);
  const bool dense = cells[0] * cells[1] * cells[2] <= static_cast<double>(buckets);
  layout_.row = dense ? static_cast<uint32_t>(cells[0]) : kVastRow;
  layout_.layer = dense ? static_cast<uint32_t>(cells[0] * cells[1]) : kVastLayer;
  std::fill(start_.begin(), start_.end(), 0u);
  for (size_t i = 0; i < points.size(); ++i) {
    bucket_[i] = usable(points[i]) ? bucket_of(points[i]) : kNoBucket;
    if (bucket_[i] != kNoBucket) ++start_[bucket_[i] + 1];
  }
  return used;
}

void OutlierFilter::sort(std::span<const Point> points) {
  for (size_t b = 1; b < start_.size(); ++b) start_[b] += start_[b - 1];
  // start_[b] moves on to the end of b while filling; moved back afterwards by shifting the array by one.
  for (size_t i = 0; i < points.size(); ++i) {
    if (bucket_[i] == kNoBucket) continue;
    const uint32_t to = start_[bucket_[i]]++;
    x_[to] = points[i].x;
    y_[to] = points[i].y;
    z_[to] = points[i].z;
    index_[to] = static_cast<uint32_t>(i);
  }
  std::copy_backward(start_.begin(), start_.end() - 1, start_.end());
  start_[0] = 0;
}

// The buckets of the 27 cells around a cell: nine rows of three neighbours, each a contiguous run unless it wraps.
size_t OutlierFilter::runs_around(uint32_t bucket, std::span<Run> runs) const {
  static constexpr int kOrder[9][2] = {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
  size_t n = 0;
  const auto add = [&](uint32_t first, uint32_t last) {
    const Run run{start_[first], start_[last + 1]};
    if (run.size() > 0) runs[n++] = run;
  };
  for (const auto& o : kOrder) {  // the own row first: most likely to hold enough
    const uint32_t middle =
        (bucket + static_cast<uint32_t>(o[0]) * layout_.row + static_cast<uint32_t>(o[1]) * layout_.layer) &
        layout_.mask;
    if (middle >= 1 && middle < layout_.mask) {
      add(middle - 1, middle + 1);
    } else {
      for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t b = (middle + k - 1) & layout_.mask;
        add(b, b);
      }
    }
  }
  return n;
}

size_t OutlierFilter::filter(std::span<const Point> points, const OutlierParameters& parameters,
                             std::span<uint8_t> keep) {
  std::fill(keep.begin(), keep.end(), uint8_t{0});
  points = points.first(std::min(points.size(), capacity()));
  if (load(points, parameters.radius_m) == 0) return 0;
  sort(points);
  const auto needed = static_cast<uint32_t>(std::max(0, parameters.n_min)) + 1;  // the point finds itself, too
  const auto radius = static_cast<float>(parameters.radius_m);
  const Coordinates sorted{x_.data(), y_.data(), z_.data()};
  Run runs[27];
  for (uint32_t b = 0; b + 1 < start_.size(); ++b) {
    const Run queries{start_[b], start_[b + 1]};
    if (queries.size() == 0) continue;
    const size_t n = runs_around(b, runs);
    uint64_t candidates = 0;
    for (size_t r = 0; r < n; ++r) candidates += runs[r].size();
    if (candidates < needed) std::fill_n(pass_.begin() + queries.first, queries.size(), uint8_t{0});
    else decide(sorted, std::span(runs, n), queries, radius * radius, needed, pass_.data());
  }
  size_t kept = 0;
  for (size_t i = 0; i < start_.back(); ++i) {
    keep[index_[i]] = pass_[i];
    kept += pass_[i];
  }
  return kept;
}

size_t OutlierFilter::filter_reference(std::span<const Point> points, const OutlierParameters& parameters,
                                       std::span<uint8_t> keep) {
  const auto radius = static_cast<float>(parameters.radius_m);
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    int others = 0;
    for (size_t k = 0; k < points.size(); ++k) {
      if (k == i || !usable(points[k])) continue;
      const float dx = points[k].x - points[i].x, dy = points[k].y - points[i].y, dz = points[k].z - points[i].z;
      others += dx * dx + dy * dy + dz * dz <= radius * radius;
    }
    keep[i] = usable(points[i]) && others >= parameters.n_min;
    kept += keep[i];
  }
  return kept;
}

size_t compact(std::span<Point> points, std::span<Colour> colours, std::span<const uint8_t> keep) {
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!keep[i]) continue;
    points[kept] = points[i];
    if (i < colours.size()) colours[kept] = colours[i];
    ++kept;
  }
  return kept;
}

}  // namespace takt::cloud
