// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/grid.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

using namespace takt::object_detection;

namespace {

/// Every position of a reference along one direction lies within a window.
bool covers(const SearchGrid& grid, int reference, bool along_x) {
  const int size = along_x ? grid.image_width : grid.image_height, count = along_x ? grid.columns : grid.rows;
  for (int at = 0; at + reference <= size; ++at) {
    bool inside = false;
    for (int i = 0; i < count && !inside; ++i) {
      const int from = along_x ? grid.x0(i) : grid.y0(i);
      inside = from <= at && at + reference <= from + grid.window_px;
    }
    if (!inside) return false;
  }
  return true;
}

std::string refusal(int width, int height, int reference, int window) {
  try {
    make_search_grid(width, height, reference, window);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("oracle 12: 640 x 480, reference 48, window 64: 37 x 27 windows at stride 16 that cover every position") {
  const SearchGrid grid = make_search_grid(640, 480, 48, 64);
  CHECK(grid.columns == 37);
  CHECK(grid.rows == 27);
  for (int u = 0; u < grid.columns; ++u) CHECK(grid.x0(u) == 16 * u);
  for (int v = 0; v < grid.rows; ++v) CHECK(grid.y0(v) == 16 * v);
  CHECK(covers(grid, 48, true));
  CHECK(covers(grid, 48, false));
}

TEST_CASE("other sizes: the fewest windows with enough overlap, from border to border, and every position covered") {
  for (const int reference : {1, 7, 24, 48, 60})
    for (const int window : {61, 64, 90})
      for (const int size : {90, 91, 128, 333, 640}) {
        CAPTURE(reference);
        CAPTURE(window);
        CAPTURE(size);
        const SearchGrid grid = make_search_grid(size, size, reference, window);
        CHECK(covers(grid, reference, true));
        CHECK(grid.x0(0) == 0);
        if (grid.columns == 1) continue;
        CHECK(grid.x0(grid.columns - 1) + window == size);
        const int overlap_rule = window - reference;  // no stride may be longer
        CHECK(size - window <= (grid.columns - 1) * overlap_rule);
        CHECK(size - window > (grid.columns - 2) * overlap_rule);
      }
}

TEST_CASE("grids that cannot be are refused with what is valid") {
  CHECK(refusal(640, 480, 64, 64).find("1 .. window - 1 = 63") != std::string::npos);
  CHECK(refusal(640, 480, 0, 64).find("reference is 0 px") != std::string::npos);
  CHECK(refusal(640, 480, 48, 256).find("at most 255") != std::string::npos);
  CHECK(refusal(640, 60, 48, 64).find("at most 60") != std::string::npos);
  CHECK(refusal(64, 64, 48, 64).empty());
}
