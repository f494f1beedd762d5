// SPDX-License-Identifier: Apache-2.0
// Which colours and orientations lie where in a square: features of the stage that verifies what the histograms found.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/orientation_bins.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

constexpr int kLayoutCells = 4;  ///< along an edge of the square; cell i begins at round(i side / kLayoutCells)
constexpr int kLayoutColours = 20,
              kLayoutOrientations = 12;  ///< pair_colour(); of lines: a gradient's modulo 180 degrees
constexpr size_t kLayoutBins = kLayoutColours + kLayoutOrientations;
constexpr size_t kLayoutFeatures = kLayoutBins * kLayoutCells * kLayoutCells;
/// 0 .. 255 each: 255 times the root of the share of a cell's pixels that has the bin, rounded. Cells row by row; of
/// each first the colours, then the orientations.
using LayoutFeatures = std::array<int16_t, kLayoutFeatures>;

/// First pixel of a cell, 0 .. kLayoutCells, from the square's edge.
constexpr int layout_edge(int cell, int side) { return (2 * cell * side + kLayoutCells) / (2 * kLayoutCells); }
/// The feature of `count` pixels of a cell's.
int16_t layout_feature(uint32_t count, int cell_pixels);

/// Features of any square of a part of an image, exactly: sums over the pixels above and to the left, for each bin.
/// Memory is taken by the constructor. One thread at a time.
class LayoutSums {
 public:
  LayoutSums(int most_width, int most_height);

  /// The part [x0, x0 + width) x [y0, y0 + height) of an image of three channels, in which it lies as a whole, at most
  /// the constructor's size (not checked).
  void take(ImageView<const uint8_t> bgr, int x0, int y0, int width, int height);
  /// Of a square that lies in the part as a whole (not checked).
  void features(const Placement& at, LayoutFeatures& out) const;

 private:
  using Counts = std::array<uint16_t, kLayoutBins>;  ///< modulo 2^16, as differences of sums are wanted alone
  const Counts& sum(int x, int y) const {
    return sums_[static_cast<size_t>(y - y0_) * stride_ + static_cast<size_t>(x - x0_)];
  }

  OrientationBins orientations_;
  int x0_ = 0, y0_ = 0;
  size_t stride_ = 0;
  std::vector<uint8_t> colours_, values_;
  std::vector<uint16_t> index_;
  std::vector<Counts> sums_;  ///< of the pixels above row y and left of column x
};

}  // namespace takt::object_detection
