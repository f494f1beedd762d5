// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/outlier_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace takt::cloud {
namespace {

// A cell is a little wider than the radius, so that rounding cannot put a neighbour two cells away.
constexpr double kCellMargin = 1.001;
constexpr size_t kFewestBuckets = size_t{1} << 20;
// Neighbouring cells of a row that hold few points are decided together, to fill a vector of queries. Rows must be
// kLongestGroup + 2 buckets apart, or their runs would overlap.
constexpr uint32_t kGroupPoints = 16, kLongestGroup = 4;
// Strides of a scene too vast for one bucket per cell: all nine neighbouring rows stay far enough apart.
constexpr uint32_t kVastRow = 1031, kVastLayer = 65537;

}  // namespace

int scaled_n_min(int n_min_full, size_t points, size_t points_full) {
  const double n = static_cast<double>(n_min_full) * static_cast<double>(points) / static_cast<double>(points_full);
  return std::max(1, static_cast<int>(std::lround(n)));
}

OutlierFilter::OutlierFilter(size_t capacity)
    : sorted_(capacity + kReadAhead),
      bucket_(capacity),
      start_(std::bit_ceil(std::max(capacity, kFewestBuckets)) + 2),
      pass_(capacity) {}

void OutlierFilter::lay_out(const Bounds& bounds, double radius_m) {
  const double edge = radius_m * kCellMargin;
  layout_.inverse_edge = 1 / edge;
  double cells[3];
  for (int a = 0; a < 3; ++a) {  // one empty cell on each side: no neighbour wraps around
    layout_.origin[a] = static_cast<double>(bounds.low[a]) - 1.5 * edge;
    cells[a] = std::floor((static_cast<double>(bounds.high[a]) - layout_.origin[a]) / edge) + 3;
  }
  cells[0] = std::max(cells[0], double{kLongestGroup + 2});
  const auto most = static_cast<double>(start_.size() - 2);
  layout_.wraps = cells[0] * cells[1] * cells[2] > most;
  layout_.row = layout_.wraps ? kVastRow : static_cast<uint32_t>(cells[0]);
  layout_.layer = layout_.wraps ? kVastLayer : static_cast<uint32_t>(cells[0] * cells[1]);
  layout_.buckets = static_cast<uint32_t>(layout_.wraps ? most : cells[0] * cells[1] * cells[2]);
}

uint32_t OutlierFilter::Layout::bucket_of(const Point& p) const {
  if (!usable(p)) return buckets;
  const auto cell = [&](float v, int axis) {  // never negative: the origin lies below all points
    return static_cast<uint32_t>(static_cast<int64_t>((static_cast<double>(v) - origin[axis]) * inverse_edge));
  };
  const uint32_t bucket = cell(p.x, 0) + cell(p.y, 1) * row + cell(p.z, 2) * layer;
  return wraps ? bucket & (buckets - 1) : bucket;
}

// A counting sort. start_[b] is where bucket b ends, and moves down to where it starts.
void OutlierFilter::sort(std::span<const Point> points) {
  const Layout layout = layout_;  // what is written below cannot be a part of it, the compiler then knows
  std::fill_n(start_.begin(), layout.buckets + 2, 0u);
  for (size_t i = 0; i < points.size(); ++i) ++start_[bucket_[i] = layout.bucket_of(points[i])];
  uint32_t sum = 0;
  for (size_t b = 0; b < layout.buckets + 2; ++b) start_[b] = sum += start_[b];
  constexpr size_t kAhead = 32;  // neighbours in the cloud may go far from one another: their places are fetched ahead
  for (size_t i = points.size(); i-- > 0;) {
    if (i >= kAhead) __builtin_prefetch(&sorted_[start_[bucket_[i - kAhead]] - 1], 1);
    sorted_[--start_[bucket_[i]]] = {points[i].x, points[i].y, points[i].z, static_cast<uint32_t>(i)};
  }
}

uint32_t OutlierFilter::last_of_group(uint32_t first) const {
  const auto fits = [&](uint32_t bucket) {
    return start_[bucket + 1] > start_[bucket] && start_[bucket + 1] - start_[first] <= kGroupPoints;
  };
  uint32_t last = first;
  while (last + 1 < std::min(layout_.buckets, first + kLongestGroup) && fits(last + 1)) ++last;
  return last;
}

// The buckets of the cells first .. last of a row and of the cells around them: nine rows, each a contiguous run
// unless it wraps. The group itself comes first, then the rest of its row: they hold most neighbours.
size_t OutlierFilter::runs_around(uint32_t first, uint32_t last, std::span<Run> runs) const {
  size_t n = 0;
  const auto add = [&](uint32_t bucket, uint32_t count) {
    if (layout_.wraps) bucket &= layout_.buckets - 1;
    const uint32_t before_end = std::min(count, layout_.buckets - bucket);
    runs[n] = {start_[bucket], start_[bucket + before_end]};
    n += runs[n].size() > 0;
    if (before_end == count) return;
    runs[n] = {start_[0], start_[count - before_end]};
    n += runs[n].size() > 0;
  };
  const uint32_t count = last - first + 1;
  add(first, count);
  add(first - 1, 1);
  add(last + 1, 1);
  static constexpr int kRows[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
  for (const auto& row : kRows)
    add(first - 1 + static_cast<uint32_t>(row[0]) * layout_.row + static_cast<uint32_t>(row[1]) * layout_.layer,
        count + 2);
  return n;
}

size_t OutlierFilter::filter(std::span<const Point> points, const OutlierParameters& parameters,
                             std::span<uint8_t> keep) {
  std::fill(keep.begin(), keep.end(), uint8_t{0});
  points = points.first(std::min(points.size(), capacity()));
  const Bounds bounds = bounds_of(points);
  unusable_ = points.size() - bounds.points;
  if (bounds.points == 0) return 0;
  lay_out(bounds, parameters.radius_m);
  sort(points);
  const auto needed = static_cast<uint32_t>(std::max(0, parameters.n_min)) + 1;  // the point finds itself, too
  const auto radius = static_cast<float>(parameters.radius_m);
  Run runs[kMostRuns];
  for (uint32_t b = 0; b < layout_.buckets; ++b) {
    const uint32_t first = b;
    if (start_[first] == start_[first + 1]) continue;
    b = last_of_group(first);
    const Run queries{start_[first], start_[b + 1]};
    const size_t n = runs_around(first, b, runs);
    uint64_t candidates = 0;
    for (size_t r = 0; r < n; ++r) candidates += runs[r].size();
    if (candidates < needed) std::fill_n(pass_.begin() + queries.first, queries.size(), uint8_t{0});
    else decide(sorted_.data(), std::span(runs, n), queries, radius * radius, needed, pass_.data());
  }
  size_t kept = 0;
  for (size_t i = 0; i < bounds.points; ++i) {
    keep[sorted_[i].index] = pass_[i];
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
