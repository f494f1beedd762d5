// SPDX-License-Identifier: Apache-2.0
// The colour stage in its slow obvious form, for tests: every window counted pixel by pixel, every bin compared.
#pragma once
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/histogram.hpp"

namespace takt::object_detection {

/// Missing masses, windows x references, as ColourStage gives them.
inline std::vector<uint16_t> colour_stage_reference(const SearchGrid& grid, ColourBins bins,
                                                    const std::vector<std::vector<Histogram>>& objects,
                                                    ImageView<const uint8_t> bgr) {
  std::vector<uint16_t> missing;
  for (int v = 0; v < grid.rows; ++v) {
    for (int u = 0; u < grid.columns; ++u) {
      std::vector<uint16_t> histogram(kColourBins);
      for (int y = grid.y0(v); y < grid.y0(v) + grid.window_px; ++y)
        for (int x = grid.x0(u); x < grid.x0(u) + grid.window_px; ++x)
          ++histogram[colour_bin(bgr.at(x, y, 0), bgr.at(x, y, 1), bgr.at(x, y, 2), bins)];
      for (const auto& views : objects)
        for (const Histogram& view : views)
          missing.push_back(static_cast<uint16_t>(missing_mass(histogram, view.count)));
    }
  }
  return missing;
}

}  // namespace takt::object_detection
