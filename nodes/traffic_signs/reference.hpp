// SPDX-License-Identifier: Apache-2.0
// The cascade in its obvious form, window by window and pixel by pixel, for tests.
#pragma once
#include <cmath>

#include "nodes/traffic_signs/cascade.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::traffic_signs {

/// How many stages the window at (x, y) passes; -1 if its standard deviation is at most 10 grey levels.
inline int stages_passed(const Cascade& cascade, ImageView<const uint8_t> grey, int x, int y) {
  const auto sum = [&](const WeightedRect& r, auto of_pixel) {
    int total = 0;
    for (int v = y + r.y; v < y + r.y + r.height; ++v)
      for (int u = x + r.x; u < x + r.x + r.width; ++u) total += of_pixel(grey.at(u, v));
    return total;
  };
  const auto pixels = [&](const WeightedRect& r) { return sum(r, [](int pixel) { return pixel; }); };
  const WeightedRect inner{1, 1, cascade.width - 2, cascade.height - 2, 1};
  const double area = inner.width * inner.height, total = pixels(inner);
  const double spread = area * sum(inner, [](int pixel) { return pixel * pixel; }) - total * total;
  if (!(spread > 0)) return -1;
  const auto norm = static_cast<float>(1 / std::sqrt(spread));
  if (!(area * static_cast<double>(norm) < 0.1)) return -1;
  int passed = 0;
  for (const Stage& stage : cascade.stages) {
    double votes = 0;
    for (const Stump& stump : stage.stumps) {
      float value = 0;
      for (const WeightedRect& r : cascade.features[static_cast<size_t>(stump.feature)])
        value += r.weight * static_cast<float>(pixels(r));
      votes += static_cast<double>(value * norm < stump.threshold ? stump.below : stump.otherwise);
    }
    if (votes < static_cast<double>(stage.threshold - 1e-5f)) break;
    ++passed;
  }
  return passed;
}

}  // namespace takt::traffic_signs
