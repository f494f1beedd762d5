// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "graph/view/layout_steps.hpp"
#include "graph/view/text_width.hpp"

namespace takt::view {
namespace {

constexpr int kSweeps = 4;

class Placer {
 public:
  Placer(const Diagram& diagram, const Arrangement& arrangement, const Spacing& spacing)
      : diagram_(diagram), arrangement_(arrangement), spacing_(spacing) {
    result_.boxes.resize(diagram.boxes.size());
    result_.rooms.resize(diagram.rooms.size());
  }

  Placement place() {
    place_columns();
    place_rooms();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (int column = 0; column < arrangement_.columns; ++column) straighten(column, true);
      for (int column = arrangement_.columns - 1; column >= 0; --column) straighten(column, false);
    }
    return std::move(result_);
  }

 private:
  const std::vector<size_t>& cell(size_t room, int column) const {
    return arrangement_.cells[room][static_cast<size_t>(column)];
  }
  int first_column(size_t room) const {
    int column = 0;
    while (column + 1 < arrangement_.columns && cell(room, column).empty()) ++column;
    return column;
  }
  int last_column(size_t room) const {
    int column = arrangement_.columns - 1;
    while (column > 0 && cell(room, column).empty()) --column;
    return column;
  }

  void place_columns() {
    double x = 0;
    for (int column = 0; column < arrangement_.columns; ++column) {
      double width = 0;
      for (size_t room = 0; room < diagram_.rooms.size(); ++room) {
        for (const size_t box : cell(room, column)) width = std::max(width, box_width(diagram_.boxes[box]));
        if (!cell(room, column).empty() && first_column(room) == column)
          width = std::max(width, text_width_px(diagram_.rooms[room], kTitlePx, true));
      }
      result_.column_left.push_back(x);
      result_.column_right.push_back(x + width);
      x += width + spacing_.channel[static_cast<size_t>(column)];
    }
  }

  double below(size_t room) const { return kRoomPadding + spacing_.below_room[room]; }
  double gap_above(size_t box) const { return kBoxGap + spacing_.above_box[box]; }

  /// From the room's title to the lower side of the last box.
  double cell_height(size_t room, int column) const {
    double height = 0;
    for (const size_t box : cell(room, column))
      height += (height > 0 ? gap_above(box) : spacing_.above_box[box]) + box_height(diagram_.boxes[box]);
    return height;
  }

  double room_height(size_t room) const {
    double height = 0;
    for (int column = 0; column < arrangement_.columns; ++column) height = std::max(height, cell_height(room, column));
    return kRoomTitleHeight + height + below(room);
  }

  /// Each room as high up as the rooms before it leave free.
  void place_rooms() {
    std::vector<double> occupied(static_cast<size_t>(arrangement_.columns), -kRoomGap);
    double bottom = 0;
    for (const size_t room : arrangement_.room_order) {
      const int first = first_column(room), last = last_column(room);
      double top = 0;
      for (int c = first; c <= last; ++c)
        top = std::max(top, occupied[static_cast<size_t>(c)] + kRoomGap + spacing_.above_room[room]);
      set_room(room, top, room_height(room));
      for (int c = first; c <= last; ++c) occupied[static_cast<size_t>(c)] = result_.rooms[room].bottom();
      bottom = std::max(bottom, result_.rooms[room].bottom());
    }
    if (!cell(Diagram::kDeviceRoom, 0).empty())
      set_room(Diagram::kDeviceRoom, 0, std::max(bottom, room_height(Diagram::kDeviceRoom)));
  }

  void set_room(size_t room, double top, double height) {
    const double left = result_.column_left[static_cast<size_t>(first_column(room))] - kRoomPadding;
    const double right = result_.column_right[static_cast<size_t>(last_column(room))] + kRoomPadding;
    result_.rooms[room] = {left, top, right - left, height};
    for (int column = first_column(room); column <= last_column(room); ++column) {
      const double slack = height - kRoomTitleHeight - below(room) - cell_height(room, column);
      set_tops(room, column, std::vector<double>(cell(room, column).size(), top + kRoomTitleHeight + slack / 2));
    }
  }

  /// Puts the boxes of a cell as near to the wanted tops as order, gaps and the room allow.
  void set_tops(size_t room, int column, const std::vector<double>& wanted) {
    const auto& boxes = cell(room, column);
    std::vector<double> heights, gaps;
    for (const size_t box : boxes) heights.push_back(box_height(diagram_.boxes[box])), gaps.push_back(gap_above(box));
    const Rect& frame = result_.rooms[room];
    const double top = frame.y + kRoomTitleHeight + (boxes.empty() ? 0 : spacing_.above_box[boxes.front()]);
    const auto tops = stack(wanted, heights, gaps, top, frame.bottom() - below(room));
    const auto c = static_cast<size_t>(column);
    for (size_t i = 0; i < boxes.size(); ++i)
      result_.boxes[boxes[i]] = {result_.column_left[c], tops[i], result_.column_right[c] - result_.column_left[c],
                                 heights[i]};
  }

  /// Moves the boxes of a column so that the edges from the left (or to the right) run straight.
  void straighten(int column, bool from_left) {
    for (size_t room = 0; room < diagram_.rooms.size(); ++room) {
      std::vector<double> wanted;
      for (const size_t box : cell(room, column)) wanted.push_back(wanted_top(box, from_left));
      if (!wanted.empty()) set_tops(room, column, wanted);
    }
  }

  double wanted_top(size_t box, bool from_left) const {
    double sum = 0;
    int count = 0;
    for (const DiagramEdge& edge : diagram_.edges) {
      const size_t near = from_left ? edge.to_box : edge.from_box;
      if (near != box || arrangement_.column[edge.from_box] >= arrangement_.column[edge.to_box]) continue;
      const double start = start_of(result_, edge).y, end = end_of(result_, edge).y;
      sum += result_.boxes[box].y + (from_left ? start - end : end - start);
      ++count;
    }
    return count > 0 ? sum / count : result_.boxes[box].y;
  }

  const Diagram& diagram_;
  const Arrangement& arrangement_;
  const Spacing& spacing_;
  Placement result_;
};

}  // namespace

Point start_of(const Placement& placement, const DiagramEdge& edge) {
  const Rect& box = placement.boxes[edge.from_box];
  return {box.right(), box.y + port_offset(edge.output)};
}

Point end_of(const Placement& placement, const DiagramEdge& edge) {
  const Rect& box = placement.boxes[edge.to_box];
  return {box.x, box.y + port_offset(edge.input)};
}

Placement place(const Diagram& diagram, const Arrangement& arrangement, const Spacing& spacing) {
  return Placer(diagram, arrangement, spacing).place();
}

}  // namespace takt::view
