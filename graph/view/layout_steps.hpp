// SPDX-License-Identifier: Apache-2.0
// Internal to graph/view: the steps of lay_out().
#pragma once
#include <vector>

#include "graph/view/layout.hpp"

namespace takt::view {

/// Column of each box: 0 for devices, else one more than the longest path of edges from the left; edges that close a
/// cycle do not count, nor do commands to devices and requests to nodes.
std::vector<int> assign_columns(const Diagram& diagram);

/// Tops y_i that are nearest to `wanted` (least squares) with y_i >= y_(i-1) + heights[i-1] + gaps[i] and all within
/// [low, high]; where they do not fit, they start at low and go beyond high. gaps[0] is not used.
std::vector<double> stack(const std::vector<double>& wanted, const std::vector<double>& heights,
                          const std::vector<double>& gaps, double low, double high);

/// Which box stands above which, and which room above which.
struct Arrangement {
  std::vector<int> column;                              ///< by box
  int columns = 1;                                      ///< number of columns
  std::vector<size_t> room_order;                       ///< rooms with boxes, without the devices
  std::vector<std::vector<std::vector<size_t>>> cells;  ///< boxes by room and column, from above
};

/// Room for the edges that pass.
struct Spacing {
  std::vector<double> above_box;   ///< in addition to the usual gap, by box
  std::vector<double> above_room;  ///< the same for rooms
  std::vector<double> below_room;  ///< within a room below its boxes
  std::vector<double> channel;     ///< width of the channel right of each column
};

struct Placement {
  std::vector<double> column_left, column_right;
  std::vector<Rect> rooms, boxes;
};

inline constexpr double kBoxGap = 26, kRoomGap = 22;
inline constexpr double kTrackSpacing = 7, kTrackClearance = 8;  ///< between passing edges, and from them to boxes

/// The order with short edges, few crossings and little height, found by exchanging pairs.
Arrangement arrange(const Diagram& diagram);
Placement place(const Diagram& diagram, const Arrangement& arrangement, const Spacing& spacing);

/// The edges' curves, and how much room they would need where they pass; with that spacing, place and route again.
struct Routing {
  std::vector<std::vector<Curve>> edges;
  Spacing needed;
};
Routing route(const Diagram& diagram, const Arrangement& arrangement, const Placement& placement);

/// Where an edge leaves its producer and meets its reader.
Point start_of(const Placement& placement, const DiagramEdge& edge);
Point end_of(const Placement& placement, const DiagramEdge& edge);

}  // namespace takt::view
