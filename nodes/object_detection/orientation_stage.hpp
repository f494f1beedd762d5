// SPDX-License-Identifier: Apache-2.0
// Second stage of the histogram cascade: histograms of oriented gradients of the windows that passed the first one
// (thesis Sec. 3.4.2; ).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/byte_references.hpp"
#include "nodes/object_detection/histogram.hpp"
#include "nodes/object_detection/window_histograms.hpp"

namespace takt::object_detection {

/// Equal, bit for bit, to counting each window's pixels and comparing all bins. Windows are asked for row by row and
/// left to right: the counts follow them, those in between cost little. Memory is taken by the constructor; the rest
/// allocates nothing. One thread at a time.
class OrientationStage {
 public:
  /// `objects`: per object the histograms of its views.
  OrientationStage(const SearchGrid& grid, const OrientationBins& bins,
                   std::span<const std::vector<Histogram>> objects);

  /// `bgr`: three channels, of the grid's image size (not checked); must stay until the last call for it. Only what
  /// the windows cover that are asked for is looked at.
  void begin(ImageView<const uint8_t> bgr);
  /// Goes to a window: to the right of the last one, or any in another row, 0 .. windows - 1.
  void go_to(size_t window);
  /// There: the missing mass of every reference of the object; valid until the next call.
  std::span<const uint16_t> missing(size_t object);

 private:
  SearchGrid grid_;
  OrientationBins bins_;
  ImageView<const uint8_t> image_;
  ByteReferences references_;
  WindowHistograms windows_;
  int row_ = -1;     ///< of windows that windows_ is in; -1 none yet
  size_t next_ = 0;  ///< window that windows_ comes to next
  std::vector<uint8_t> values_;
  std::vector<uint16_t> missing_;
};

}  // namespace takt::object_detection
