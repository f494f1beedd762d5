// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/evaluate.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {
namespace {

double percent(int64_t part, int64_t whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

double MaskScore::precision_pct() const { return percent(right, right + wrong); }
double MaskScore::recall_pct() const { return percent(right, right + missed); }

void add(MaskScore& score, ImageView<const uint8_t> mask, ImageView<const uint8_t> truth) {
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      const auto is = static_cast<Truth>(truth.at(x, y));
      if (is == Truth::ignored) continue;
      const bool called = mask.at(x, y) != 0;
      score.right += called && is == Truth::ground;
      score.wrong += called && is == Truth::other;
      score.missed += !called && is == Truth::ground;
    }
}

std::vector<double> free_range(ImageView<const uint8_t> mask, uint8_t is_ground, const FloorProjection& projection,
                               const FloorPoint& foot, double range_max_m) {
  std::vector<double> range(static_cast<size_t>(mask.width), range_max_m);
  for (int x = 0; x < mask.width; ++x) {
    int y = mask.height - 1;
    while (y >= 0 && mask.at(x, y) == is_ground) --y;
    if (y < 0) continue;
    const auto floor = projection.floor_at(x, y);
    if (!floor) continue;
    const double distance = std::hypot(floor->x_m - foot.x_m, floor->y_m - foot.y_m);
    range[static_cast<size_t>(x)] = std::min(distance, range_max_m);
  }
  return range;
}

void add_border_errors(const std::vector<double>& a, const std::vector<double>& b, double range_max_m,
                       std::vector<double>& errors) {
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    if (a[i] < range_max_m || b[i] < range_max_m) errors.push_back(std::abs(a[i] - b[i]));
}

void bottom_is_ground(ImageView<uint8_t> mask) {
  for (int y = 0; y < mask.height; ++y)
    std::fill_n(mask.row(y), mask.width, static_cast<uint8_t>(10 * y >= 6 * mask.height ? 255 : 0));
}

}  // namespace takt::ground_map
