// SPDX-License-Identifier: Apache-2.0
#include "graph/view/layout.hpp"

#include <algorithm>

#include "graph/view/layout_steps.hpp"
#include "graph/view/text_width.hpp"

namespace takt::view {
namespace {

constexpr double kBetweenPorts = 18;  // from the text of an input to that of the output in the same row

double input_width(const DiagramInput& input) {
  const std::string latch = input.latch_text();
  return text_width_px(input.name, kTextPx) + (latch.empty() ? 0 : 8 + text_width_px(latch, kSmallPx));
}

double output_width(const DiagramOutput& output) {
  return text_width_px(output.name, kTextPx) + 8 + text_width_px(output.type, kSmallPx);
}

/// Moves everything so that nothing lies left of or above 0, and measures it.
void fit(Layout& layout) {
  Point low{1e9, 1e9}, high{0, 0};
  const auto cover = [&](Point point) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  };
  const auto each_point = [&](const auto& act) {
    for (auto& edge : layout.edges)
      for (Curve& curve : edge)
        for (Point* point : {&curve.from, &curve.control_from, &curve.control_to, &curve.to}) act(*point);
  };
  for (const auto* rects : {&layout.rooms, &layout.boxes})
    for (const Rect& rect : *rects)
      if (rect.width > 0) cover({rect.x, rect.y}), cover({rect.right(), rect.bottom()});
  each_point(cover);
  if (low.x > high.x) low = {0, 0};
  for (auto* rects : {&layout.rooms, &layout.boxes})
    for (Rect& rect : *rects) rect.x -= low.x, rect.y -= low.y;
  each_point([&](Point& point) { point = {point.x - low.x, point.y - low.y}; });
  layout.width = high.x - low.x;
  layout.height = high.y - low.y;
}

}  // namespace

double box_width(const DiagramBox& box) {
  const double mark = box.high ? 10 + text_width_px("high", kSmallPx, true) : 0;
  double width = text_width_px(box.id, kTitlePx, true) + mark;
  width = std::max(width, text_width_px(box.type + ", " + box.release, kTextPx));
  width = std::max(width, text_width_px(box.times, kTextPx));
  for (size_t row = 0; row < std::max(box.inputs.size(), box.outputs.size()); ++row) {
    const double in = row < box.inputs.size() ? input_width(box.inputs[row]) : 0;
    const double out = row < box.outputs.size() ? output_width(box.outputs[row]) : 0;
    width = std::max(width, in + out + (in > 0 && out > 0 ? kBetweenPorts : 0));
  }
  return width + 2 * kBoxMargin;
}

double box_height(const DiagramBox& box) {
  const auto rows = static_cast<double>(std::max(box.inputs.size(), box.outputs.size()));
  return kHeaderHeight + (rows > 0 ? rows * kRowHeight + 8 : 0);
}

double port_offset(size_t row) { return kHeaderHeight + 4 + (static_cast<double>(row) + 0.5) * kRowHeight; }

Layout lay_out(const Diagram& diagram) {
  const Arrangement arrangement = arrange(diagram);
  const std::vector<double> none(diagram.rooms.size(), 0);
  Spacing spacing{std::vector<double>(diagram.boxes.size(), 0), none, none,
                  std::vector<double>(static_cast<size_t>(arrangement.columns), 0)};
  // The first routing tells how many edges pass where, the second has room for them.
  spacing = route(diagram, arrangement, place(diagram, arrangement, spacing)).needed;
  Placement placement = place(diagram, arrangement, spacing);
  Routing routing = route(diagram, arrangement, placement);
  Layout layout;
  layout.rooms = std::move(placement.rooms);
  layout.boxes = std::move(placement.boxes);
  layout.edges = std::move(routing.edges);
  fit(layout);
  return layout;
}

}  // namespace takt::view
