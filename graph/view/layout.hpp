// SPDX-License-Identifier: Apache-2.0
// Where everything of a diagram stands. Devices are the first column, a node stands in the column of its longest path
// from them; a room keeps its nodes together. Edges run in the channels between columns and in the gaps between boxes,
// so that none runs through a box. Same input, same picture.
#pragma once
#include <vector>

#include "graph/view/diagram.hpp"

namespace takt::view {

/// All lengths in px, x to the right, y down.
struct Point {
  double x = 0, y = 0;
};
struct Rect {
  double x = 0, y = 0, width = 0, height = 0;
  double right() const { return x + width; }
  double bottom() const { return y + height; }
};
/// A cubic Bezier curve.
struct Curve {
  Point from, control_from, control_to, to;
};

struct Layout {
  double width = 0, height = 0;           ///< everything lies within [0, width] x [0, height]
  std::vector<Rect> rooms, boxes;         ///< as in the diagram; a room without boxes has no size
  std::vector<std::vector<Curve>> edges;  ///< from the right side of the producer to the left side of the reader
};

Layout lay_out(const Diagram& diagram);

// What a box needs, so that drawing and layout agree.
inline constexpr double kTitlePx = 14, kTextPx = 12, kSmallPx = 11;  ///< font sizes
inline constexpr double kBoxMargin = 12;                             ///< left and right of the text
inline constexpr double kHeaderHeight = 60, kRowHeight = 19;
inline constexpr double kRoomTitleHeight = 30, kRoomPadding = 14;
inline constexpr double kArrowLength = 8;

double box_width(const DiagramBox& box);
double box_height(const DiagramBox& box);
/// Of port `row` (input or output), from the top of the box to the middle of the row.
double port_offset(size_t row);

}  // namespace takt::view
