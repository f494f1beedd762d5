// SPDX-License-Identifier: Apache-2.0
// Cascades that no one trained: any features, thresholds at which about half of all windows go either way.
#pragma once
#include <random>

#include "nodes/traffic_signs/cascade.hpp"

namespace takt::test {

inline traffic_signs::Cascade random_cascade(uint32_t seed, int width, int height, int stages) {
  std::mt19937 engine(seed);
  const auto in = [&](int low, int high) {
    return low + static_cast<int>(engine() % static_cast<uint32_t>(high - low + 1));
  };
  const auto real = [&](float scale) { return scale * (static_cast<float>(engine() % 20001) / 10000.0f - 1.0f); };
  traffic_signs::Cascade cascade;
  cascade.width = width;
  cascade.height = height;
  for (int i = 0; i < 40; ++i) {
    auto& feature = cascade.features.emplace_back();
    for (int k = 0; k < 2 + i % 2; ++k) {
      const int x = in(0, width - 2), y = in(0, height - 2);
      feature[static_cast<size_t>(k)] = {x, y, in(1, width - x), in(1, height - y), k == 0 ? -1.0f : 1.5f + real(0.5f)};
    }
  }
  for (int s = 0; s < stages; ++s) {
    auto& stage = cascade.stages.emplace_back();
    for (int i = 0; i < 3 + s; ++i) stage.stumps.push_back({in(0, 39), real(0.6f), real(1.0f), real(1.0f)});
    stage.threshold = -0.6f;
  }
  return cascade;
}

}  // namespace takt::test
