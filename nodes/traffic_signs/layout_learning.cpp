// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/layout_learning.hpp"

#include <cmath>
#include <opencv2/core.hpp>

#include "rt/msg/point.hpp"

namespace takt::traffic_signs {
namespace {

constexpr int kDrawings = 300, kCells = 120, kSmallest_px = 20, kLargest_px = 100;
constexpr double kColoured = 0.65, kPlain = 0.25;

/// Ground that colour_of() takes for the colour.
cv::Vec3f ground(SignColour colour) {
  switch (colour) {
    case SignColour::red: return {30, 25, 190};
    case SignColour::yellow: return {20, 190, 230};
    case SignColour::blue: return {170, 80, 20};
    case SignColour::any: break;
  }
  return cv::Vec3f::all(120);
}

}  // namespace

ColourLayout learn_layout(SignClass sign, uint64_t seed) {
  const SignShape& shape = kSignShapes[static_cast<size_t>(sign)];
  if (shape.colour == SignColour::any) return {};
  const double edge_m = std::sqrt(shape.width_m * shape.height_m / kCells);
  const int columns = cvRound(shape.width_m / edge_m), rows = cvRound(shape.height_m / edge_m);
  std::vector<int> counts(static_cast<size_t>(columns * rows));
  cv::RNG random(seed + 1);
  for (int drawing = 0; drawing < kDrawings; ++drawing) {
    const auto edge = static_cast<float>(random.uniform(kSmallest_px, kLargest_px));
    cv::Mat3f image(cvCeil(edge) + 8, cvCeil(edge) + 8, ground(drawing % 2 == 0 ? shape.colour : SignColour::any));
    const cv::Rect2f drawn = draw_sign(image, sign, {4, 4, edge, edge}, random);
    cv::Mat3b bytes;
    image.convertTo(bytes, CV_8U);
    const Box box{cvRound(drawn.x), cvRound(drawn.y), cvRound(drawn.width), cvRound(drawn.height)};
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const Colour cell = cell_colour({bytes.ptr(), bytes.cols, bytes.rows, 3}, box, columns, rows, column, row);
        counts[static_cast<size_t>(row * columns + column)] += colour_of(cell.b, cell.g, cell.r) == shape.colour;
      }
  }
  ColourLayout layout{columns, {}};
  for (const int count : counts) {
    const double share = static_cast<double>(count) / kDrawings;
    layout.cells.push_back(share >= kColoured ? ColourLayout::Cell::coloured
                           : share <= kPlain  ? ColourLayout::Cell::plain
                                              : ColourLayout::Cell::either);
  }
  return layout;
}

}  // namespace takt::traffic_signs
