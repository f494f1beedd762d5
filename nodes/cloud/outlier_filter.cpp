// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/outlier_filter.hpp"

#include <algorithm>
#include <cmath>

namespace takt::cloud {
namespace {

// A cell is a little wider than the radius, so that rounding cannot put a neighbour two cells away.
constexpr double kCellMargin = 1.001;
// Neighbouring cells of a row that hold few points are decided together, to fill a vector of queries. With one more on
// each side they must not reach the next row of cells.
constexpr uint32_t kGroupPoints = 16, kLongestGroup = 4;

}  // namespace

int scaled_n_min(int n_min_full, size_t points, size_t points_full) {
  const double n = static_cast<double>(n_min_full) * static_cast<double>(points) / static_cast<double>(points_full);
  return std::max(1, static_cast<int>(std::lround(n)));
}

OutlierFilter::OutlierFilter(size_t capacity) : cells_(capacity), pass_(capacity) {}

void OutlierFilter::sort(std::span<const Point> points, const Bounds& bounds, double radius_m) {
  const double edge = radius_m * kCellMargin, per_m = 1 / edge;
  double origin[3], cells[3];
  for (int a = 0; a < 3; ++a) {  // one empty cell on each side: no neighbour wraps around
    origin[a] = static_cast<double>(bounds.low[a]) - 1.5 * edge;
    cells[a] = std::floor((static_cast<double>(bounds.high[a]) - origin[a]) / edge) + 3;
  }
  layout_ = cells_.layout(cells, 2 * points.size());
  const auto cell = [&](float v, int axis) {  // never negative: the origin lies below all points
    return static_cast<uint32_t>(static_cast<int64_t>((static_cast<double>(v) - origin[axis]) * per_m));
  };
  const CellLayout layout = layout_;  // a copy of which the compiler knows that sorting does not change it
  cells_.sort(points, layout, [&](const Point& p) {
    return usable(p) ? layout.bucket(cell(p.x, 0), cell(p.y, 1), cell(p.z, 2)) : layout.buckets;
  });
}

uint32_t OutlierFilter::last_of_group(uint32_t first) const {
  const auto start = cells_.start();
  const auto fits = [&](uint32_t bucket) {
    return start[bucket + 1] > start[bucket] && start[bucket + 1] - start[first] <= kGroupPoints;
  };
  uint32_t last = first;
  while (last + 1 < std::min(layout_.buckets, first + kLongestGroup) && fits(last + 1)) ++last;
  return last;
}

// The buckets of the cells first .. last of a row and of the cells around them: nine rows, each a contiguous run
// unless it wraps. The group itself comes first, then the rest of its row: they hold most neighbours.
size_t OutlierFilter::runs_around(uint32_t first, uint32_t last, std::span<Run> runs) const {
  const auto start = cells_.start();
  size_t n = 0;
  const auto add_unwrapped = [&](uint32_t bucket, uint32_t count) {
    runs[n] = {start[bucket], start[bucket + count]};
    n += runs[n].size() > 0;
  };
  const auto add = [&](uint32_t bucket, uint32_t count) {
    bucket = layout_.wrapped(bucket);
    const uint32_t before_end = std::min(count, layout_.buckets - bucket);
    add_unwrapped(bucket, before_end);
    if (before_end < count) add_unwrapped(0, count - before_end);
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
  const Bounds bounds = bounds_of(points, kFarthest_m);
  unusable_ = points.size() - bounds.points;
  if (bounds.points == 0) return 0;
  sort(points, bounds, parameters.radius_m);
  const SortedPoint* sorted = cells_.points();
  const auto start = cells_.start();
  const auto needed = static_cast<uint32_t>(std::max(0, parameters.n_min)) + 1;  // the point finds itself, too
  const auto radius = static_cast<float>(parameters.radius_m);
  for (uint32_t first = 0, last = 0; first < layout_.buckets; first = last + 1) {
    last = first;
    if (start[first] == start[first + 1]) continue;
    last = last_of_group(first);
    const Run queries{start[first], start[last + 1]};
    Run runs[kMostRuns];
    const size_t n = runs_around(first, last, runs);
    uint64_t candidates = 0;
    for (size_t r = 0; r < n; ++r) candidates += runs[r].size();
    if (candidates < needed) std::fill_n(pass_.begin() + queries.first, queries.size(), uint8_t{0});
    else decide(sorted, std::span(runs, n), queries, radius * radius, needed, pass_.data());
  }
  size_t kept = 0;
  for (size_t i = 0; i < bounds.points; ++i) {
    keep[sorted[i].index] = pass_[i];
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
