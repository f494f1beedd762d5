// SPDX-License-Identifier: Apache-2.0
// Where a sign has its colour and where it must not: cascades see grey alone, and a red patch is no red border.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/traffic_signs/colour_regions.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::traffic_signs {

/// A grid over the sign's box; empty: any picture fits.
struct ColourLayout {
  enum class Cell : uint8_t { either, coloured, plain };
  int columns = 0;
  std::vector<Cell> cells;  ///< row by row
  int rows() const { return columns == 0 ? 0 : static_cast<int>(cells.size()) / columns; }
};

/// Reads rows of equal length of the letters `x` (coloured), `o` (plain), `.` (either); # begins a comment. At most 64
/// each way. Throws CascadeError with file and line.
ColourLayout read_layout(const std::filesystem::path& file);

/// Throws CascadeError if the file cannot be written. `comment`: where it comes from, one line.
void write_layout(const ColourLayout& layout, const std::filesystem::path& file, const std::string& comment);

/// Mean of four pixels around the middle of a cell of a columns x rows grid over the box. Places beyond the image's
/// edge count as the nearest in it. `bgr`: three channels, not empty (not checked).
Colour cell_colour(ImageView<const uint8_t> bgr, const Box& box, int columns, int rows, int column, int row);

/// How much of a colour there is in a pixel, 0..1, whatever the light: red max(0, r - max(g, b)) / r, blue likewise,
/// yellow max(0, min(r, g) - b) / max(r, g). 0 for `any`.
double strength(SignColour colour, const Colour& pixel);

/// Mean strength of the colour in the coloured cells, less that in the plain ones: -1..1; 1 if the layout is empty. A
/// difference, because coloured light and fading change both. Fewer than ten plain cells count as parts of ten: what
/// they show is left to chance. Allocates nothing.
double layout_fit(const ColourLayout& layout, SignColour colour, ImageView<const uint8_t> bgr, const Box& box);

}  // namespace takt::traffic_signs
