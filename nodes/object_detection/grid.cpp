// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/grid.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt::object_detection {

SearchGrid make_search_grid(int image_width, int image_height, int reference_px, int window_px) {
  if (reference_px < 1 || reference_px >= window_px)
    throw std::invalid_argument("reference is " + std::to_string(reference_px) + " px, must lie in 1 .. window - 1 = " +
                                std::to_string(window_px - 1) + ": the overlap of windows is the reference's size");
  if (window_px > 255 || window_px > std::min(image_width, image_height))
    throw std::invalid_argument("window is " + std::to_string(window_px) + " px, must be at most " +
                                std::to_string(std::min({255, image_width, image_height})) + " for images of " +
                                std::to_string(image_width) + " x " + std::to_string(image_height) + " px");
  const int stride = window_px - reference_px;
  const auto count = [&](int size) { return 1 + (size - window_px + stride - 1) / stride; };
  SearchGrid grid;
  grid.image_width = image_width;
  grid.image_height = image_height;
  grid.window_px = window_px;
  grid.columns = count(image_width);
  grid.rows = count(image_height);
  return grid;
}

}  // namespace takt::object_detection
