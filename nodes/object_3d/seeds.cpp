// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/seeds.hpp"

#include <algorithm>
#include <cmath>

namespace takt::object_3d {

Hsv hsv_of(const Colour& colour) {
  const int b = colour.b, g = colour.g, r = colour.r;
  const int high = std::max({b, g, r}), spread = high - std::min({b, g, r});
  if (spread == 0) return {0, 0, high / 255.0};
  double sextant = 0;
  if (high == r) sextant = static_cast<double>(g - b) / spread + (g < b ? 6 : 0);
  else if (high == g) sextant = 2 + static_cast<double>(b - r) / spread;
  else sextant = 4 + static_cast<double>(r - g) / spread;
  return {60 * sextant, static_cast<double>(spread) / high, high / 255.0};
}

bool ColourModel::holds(const Colour& colour) const {
  const Hsv hsv = hsv_of(colour);
  const bool around = hue_low_deg > hue_high_deg;
  const bool above = hsv.hue_deg >= hue_low_deg, below = hsv.hue_deg <= hue_high_deg;
  return (around ? above || below : above && below) && hsv.saturation >= saturation_low &&
         hsv.saturation <= saturation_high && hsv.value >= value_low && hsv.value <= value_high;
}

ColourSeeds::ColourSeeds(size_t cells) : mask_(cells), other_(cells), cells_(cells), scratch_(cells) {}

/// The lowest or highest value of the square around each cell: erosion, dilation. What lies outside the grid does not
/// count.
void ColourSeeds::each_window(const PixelGrid& grid, int half, Window wanted) {
  const int columns = grid.columns(), rows = grid.rows();
  const auto pass = [&](const std::vector<uint8_t>& from, std::vector<uint8_t>& to, bool along_row) {
    const int last = along_row ? columns - 1 : rows - 1, stride = along_row ? 1 : columns;
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const int at = along_row ? x : y, line = y * columns + x - at * stride;
        uint8_t value = from[static_cast<size_t>(y * columns + x)];
        for (int k = std::max(0, at - half); k <= std::min(last, at + half); ++k) {
          const uint8_t other = from[static_cast<size_t>(line + k * stride)];
          value = wanted == Window::lowest ? std::min(value, other) : std::max(value, other);
        }
        to[static_cast<size_t>(y * columns + x)] = value;
      }
  };
  pass(mask_, other_, true);
  pass(other_, mask_, false);
}

/// Takes the component of a cell out of `other_` into `cells_`.
size_t ColourSeeds::flood(const PixelGrid& grid, size_t first) {
  const int columns = grid.columns(), rows = grid.rows();
  size_t count = 1;
  cells_[0] = static_cast<uint32_t>(first);
  other_[first] = 0;
  for (size_t done = 0; done < count; ++done) {
    const int x = static_cast<int>(cells_[done]) % columns, y = static_cast<int>(cells_[done]) / columns;
    for (int v = std::max(0, y - 1); v <= std::min(rows - 1, y + 1); ++v)
      for (int u = std::max(0, x - 1); u <= std::min(columns - 1, x + 1); ++u) {
        const auto cell = static_cast<size_t>(v * columns + u);
        if (other_[cell] == 0) continue;
        other_[cell] = 0;
        cells_[count++] = static_cast<uint32_t>(cell);
      }
  }
  return count;
}

uint32_t ColourSeeds::median_point(const PixelGrid& grid, size_t count) {
  const int columns = grid.columns();
  const auto median = [&](const auto& of_cell) {
    std::transform(cells_.begin(), cells_.begin() + static_cast<ptrdiff_t>(count), scratch_.begin(), of_cell);
    const auto middle = scratch_.begin() + static_cast<ptrdiff_t>(count / 2);
    std::nth_element(scratch_.begin(), middle, scratch_.begin() + static_cast<ptrdiff_t>(count));
    return *middle;
  };
  const int column = median([&](uint32_t cell) { return static_cast<int>(cell) % columns; });
  const int row = median([&](uint32_t cell) { return static_cast<int>(cell) / columns; });
  int32_t best = PixelGrid::kNone;
  int64_t nearest = INT64_MAX;
  for (size_t i = 0; i < count; ++i) {
    const int x = static_cast<int>(cells_[i]) % columns, y = static_cast<int>(cells_[i]) / columns;
    const int64_t dx = x - column, dy = y - row, distance = dx * dx + dy * dy;
    if (grid.at(x, y) == PixelGrid::kNone || distance >= nearest) continue;
    nearest = distance;
    best = grid.at(x, y);
  }
  return static_cast<uint32_t>(best);  // opening leaves no component without a point
}

size_t ColourSeeds::find(const PixelGrid& grid, std::span<const Colour> colours, const ColourModel& model,
                         const ComponentLimits& limits, int step_px, std::span<uint32_t> seeds) {
  std::fill(mask_.begin(), mask_.end(), uint8_t{0});
  for (int y = 0; y < grid.rows(); ++y)
    for (int x = 0; x < grid.columns(); ++x) {
      const int32_t point = grid.at(x, y);
      const bool seen = point != PixelGrid::kNone && model.holds(colours[static_cast<size_t>(point)]);
      mask_[static_cast<size_t>(y * grid.columns() + x)] = seen ? 1 : 0;
    }
  each_window(grid, 1, Window::lowest);  // opening
  each_window(grid, 1, Window::highest);
  each_window(grid, 2, Window::highest);  // closing
  each_window(grid, 2, Window::lowest);
  std::copy_n(mask_.begin(), grid.cells(), other_.begin());
  const double cell_px = static_cast<double>(step_px) * step_px;
  size_t found = 0;
  for (size_t cell = 0; cell < grid.cells() && found < seeds.size(); ++cell) {
    if (other_[cell] == 0) continue;
    const size_t count = flood(grid, cell);
    const double area_px = static_cast<double>(count) * cell_px;
    if (area_px >= limits.smallest_px && area_px <= limits.largest_px) seeds[found++] = median_point(grid, count);
  }
  return found;
}

std::optional<uint32_t> seed_in_box(const PixelGrid& grid, std::span<const Point> points, const Detection& box,
                                    int step_px, std::span<uint32_t> scratch) {
  const auto cell = [&](float px, int last) {
    return static_cast<int>(std::clamp(px / static_cast<float>(step_px), 0.0f, static_cast<float>(last)));
  };
  if (grid.empty()) return std::nullopt;
  const int left = cell(box.x_px + box.width_px / 4, grid.columns() - 1),
            right = cell(box.x_px + 3 * box.width_px / 4, grid.columns() - 1),
            top = cell(box.y_px + box.height_px / 4, grid.rows() - 1),
            bottom = cell(box.y_px + 3 * box.height_px / 4, grid.rows() - 1);
  size_t count = 0;
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x)
      if (grid.at(x, y) != PixelGrid::kNone) scratch[count++] = static_cast<uint32_t>(grid.at(x, y));
  if (count == 0) return std::nullopt;
  const auto middle = scratch.begin() + static_cast<ptrdiff_t>(count / 2);
  std::nth_element(scratch.begin(), middle, scratch.begin() + static_cast<ptrdiff_t>(count),
                   [&](uint32_t a, uint32_t b) { return std::pair(points[a].z, a) < std::pair(points[b].z, b); });
  return *middle;
}

}  // namespace takt::object_3d
