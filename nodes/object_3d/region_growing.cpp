// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/region_growing.hpp"

#include <algorithm>

#include "nodes/cloud/count_kernel.hpp"

namespace takt::object_3d {
namespace {

// A cell is a little wider than d_max, so that rounding cannot put a neighbour two cells away.
constexpr double kCellMargin = 1.001;

/// Fast and slow form decide with the same operations.
bool near(const Point& a, const Point& b, float d_max_m) {
  const float dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
  return dx * dx + dy * dy + dz * dz <= d_max_m * d_max_m;
}

bool alike(const Colour& a, const Colour& b, const GrowParameters& p) {
  return p.colour_max <= 0 || chromaticity_distance(a, b) <= p.colour_max;
}

}  // namespace

float chromaticity_distance(const Colour& a, const Colour& b) {
  const float sum_a = static_cast<float>(std::max(1, a.b + a.g + a.r)),
              sum_b = static_cast<float>(std::max(1, b.b + b.g + b.r));
  const float third = 1.0f / 3;
  const auto share = [&](uint8_t channel, float sum) { return sum > 1 ? channel / sum : third; };
  const float db = share(a.b, sum_a) - share(b.b, sum_b), dg = share(a.g, sum_a) - share(b.g, sum_b),
              dr = share(a.r, sum_a) - share(b.r, sum_b);
  return std::sqrt(db * db + dg * dg + dr * dr);
}

RegionGrower::RegionGrower(size_t capacity)
    : cells_(capacity), open_(capacity), open_end_(cells_.start().size()), touched_(capacity), region_(capacity) {}

void RegionGrower::fill(std::span<const Point> points, std::span<const Colour> colours,
                        const GrowParameters& parameters) {
  points_ = points.first(std::min(points.size(), cells_.capacity()));
  colours_ = colours;
  parameters_ = parameters;
  if (colours_.size() != points.size()) parameters_.colour_max = 0;
  found_ = looked_ = touched_count_ = 0;
  if (points_.empty()) return;
  const cloud::Bounds bounds = cloud::bounds_of(points_, cloud::kFarthest_m);
  const double edge = static_cast<double>(parameters.d_max_m) * kCellMargin;
  per_m_ = 1 / edge;
  double cells[3];
  for (int a = 0; a < 3; ++a) {  // one empty cell on each side: no neighbour lies outside
    origin_[a] = static_cast<double>(bounds.low[a]) - 1.5 * edge;
    cells[a] = std::floor((static_cast<double>(bounds.high[a]) - origin_[a]) / edge) + 3;
  }
  layout_ = cells_.layout(cells, 2 * points_.size());
  cells_.sort(points_, layout_,
              [&](const Point& p) { return layout_.bucket(cell(p.x, 0), cell(p.y, 1), cell(p.z, 2)); });
  std::copy_n(cells_.points(), points_.size(), open_.begin());
  std::copy_n(cells_.start().begin() + 1, layout_.buckets, open_end_.begin());
}

/// A bucket whose points were taken still holds all of them, in another order.
void RegionGrower::restore() {
  for (size_t i = 0; i < touched_count_; ++i) open_end_[touched_[i]] = cells_.start()[touched_[i] + 1];
  touched_count_ = 0;
}

void RegionGrower::begin(uint32_t seed, const Reach& reach) {
  restore();
  seed_ = points_[seed];
  reach_ = reach;
  cut_ = false;
  looked_ = 0;
  found_ = 1;
  region_[0] = seed;
}

bool RegionGrower::advance(size_t count) {
  const auto left = [&] { return looked_ < found_ && looked_ < parameters_.i_max; };
  for (; count > 0 && left(); --count) look_around(region_[looked_++]);
  return left();
}

void RegionGrower::look_around(uint32_t index) {
  const Point from = points_[index];
  const Colour colour = parameters_.colour_max > 0 ? colours_[index] : Colour{};
  const uint32_t x = cell(from.x, 0) - 1, y = cell(from.y, 1) - 1, z = cell(from.z, 2) - 1;
  const size_t before = found_;
  for (uint32_t dz = 0; dz < 3; ++dz)
    for (uint32_t dy = 0; dy < 3; ++dy)
      for (uint32_t dx = 0; dx < 3; ++dx) search_bucket(layout_.bucket(x + dx, y + dy, z + dz), from, colour);
  std::sort(region_.begin() + static_cast<ptrdiff_t>(before), region_.begin() + static_cast<ptrdiff_t>(found_));
}

void RegionGrower::search_bucket(uint32_t bucket, const Point& from, const Colour& colour) {
  const uint32_t first = cells_.start()[bucket], whole = cells_.start()[bucket + 1];
  uint32_t& end = open_end_[bucket];
  for (uint32_t k = first; k < end;) {
    const cloud::SortedPoint& p = open_[k];
    const bool own = p.index == region_[0];  // the seed is in the region from the beginning
    if (!own && (!near(from, {p.x, p.y, p.z}, parameters_.d_max_m) ||
                 (parameters_.colour_max > 0 && !alike(colour, colours_[p.index], parameters_)))) {
      ++k;
      continue;
    }
    const bool within = reach_.holds(seed_, p.x, p.y, p.z);
    if (!own && within) region_[found_++] = p.index;
    cut_ |= !within;
    if (end == whole) touched_[touched_count_++] = bucket;
    std::swap(open_[k], open_[--end]);
  }
}

Region grow_reference(std::span<const Point> points, std::span<const Colour> colours, const GrowParameters& parameters,
                      uint32_t seed, const Reach& reach) {
  GrowParameters p = parameters;
  if (colours.size() != points.size()) p.colour_max = 0;
  Region region{{seed}, false};
  std::vector<bool> visited(points.size());
  visited[seed] = true;
  for (size_t i = 0; i < region.points.size() && i < p.i_max; ++i) {
    const uint32_t from = region.points[i];
    for (uint32_t k = 0; k < points.size(); ++k) {
      if (visited[k] || !near(points[from], points[k], p.d_max_m)) continue;
      if (p.colour_max > 0 && !alike(colours[from], colours[k], p)) continue;
      const bool within = reach.holds(points[seed], points[k].x, points[k].y, points[k].z);
      region.cut |= !within;
      visited[k] = within;
      if (within) region.points.push_back(k);
    }
  }
  return region;
}

}  // namespace takt::object_3d
