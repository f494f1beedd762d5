// SPDX-License-Identifier: Apache-2.0
// Where an image has the saturated colours of signs (C-11): a row of windows without them is not
// searched.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "nodes/traffic_signs/grouping.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::traffic_signs {

enum class SignColour : uint8_t { any, red, yellow, blue };
inline constexpr std::array<std::string_view, 4> kColourNames{"any", "red", "yellow", "blue"};  ///< in its order

/// The colour of a pixel: yellow if 4 min(r, g) >= 5 b + 8 and 5 g >= 3 r, else red if 5 r >= 7 max(g, b) + 10, else
/// blue if 8 b >= 9 max(r, g) + 16; ratios, so that the light matters little. Otherwise `any`.
SignColour colour_of(uint8_t b, uint8_t g, uint8_t r);

/// Counts of coloured pixels in rectangles, in whole cells of 4 x 4 px. Memory is taken by the constructor; the rest
/// allocates nothing.
class ColourRegions {
 public:
  static constexpr int kCell_px = 4;
  ColourRegions(int width, int height);

  /// `bgr`: three channels, of the constructor's size (not checked).
  void count(ImageView<const uint8_t> bgr);
  /// Pixels of the colour, not `any`, in the cells that the box touches.
  int pixels(SignColour colour, const Box& box) const;

 private:
  size_t at(int column, int row) const { return static_cast<size_t>(row * (columns_ + 1) + column); }

  int columns_, rows_;
  std::vector<int32_t> sums_[3];  ///< integral images over cells: red, yellow, blue
  std::vector<int32_t> row_[3];
};

}  // namespace takt::traffic_signs
