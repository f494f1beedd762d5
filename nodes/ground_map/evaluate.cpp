// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/evaluate.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {
namespace {

double percent(int64_t part, int64_t whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Row of the lowest pixel of a column that is not `ground`; -1: none.
int border_row(ImageView<const uint8_t> mask, int x, uint8_t ground) {
  int y = mask.height - 1;
  while (y >= 0 && mask.at(x, y) == ground) --y;
  return y;
}

}  // namespace

void map_image(ImageView<const uint8_t> image, const FloorProjection& in_robot, const PlanarPose& robot_in_map,
               GroundDetector& detector, GroundGrid& grid, ImageView<uint8_t> mask, bool area_free) {
  const FloorPoint robot{robot_in_map.x_m, robot_in_map.y_m};
  detector.analyse(image);
  if (area_free) detector.learn();
  detector.classify(mask, in_robot);
  grid.centre(robot);
  if (detector.too_dark()) grid.see_nothing();
  else grid.observe(mask, in_robot.moved(robot_in_map), robot, detector.confidence());
  grid.accumulate();
}

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
    const int y = border_row(mask, x, is_ground);
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

double DoubtScore::false_doubted_pct() const { return percent(false_doubted, false_borders); }
double DoubtScore::true_doubted_pct() const { return percent(true_doubted, true_borders); }

void add(DoubtScore& score, ImageView<const uint8_t> mask, ImageView<const uint8_t> truth, const Confidence& confidence,
         int beyond_px) {
  for (int x = 0; x < mask.width; ++x) {
    const int y = border_row(mask, x, 255);
    if (y < 0) continue;
    const int beyond = std::max(0, y - beyond_px);
    const bool floor_goes_on = static_cast<Truth>(truth.at(x, beyond)) == Truth::ground;
    const bool doubted = confidence.at(x, beyond) < kSure;
    (floor_goes_on ? score.false_borders : score.true_borders) += 1;
    (floor_goes_on ? score.false_doubted : score.true_doubted) += doubted;
  }
}

void bottom_is_ground(ImageView<uint8_t> mask) {
  for (int y = 0; y < mask.height; ++y)
    std::fill_n(mask.row(y), mask.width, static_cast<uint8_t>(10 * y >= 6 * mask.height ? 255 : 0));
}

}  // namespace takt::ground_map
