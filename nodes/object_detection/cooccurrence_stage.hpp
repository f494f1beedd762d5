// SPDX-License-Identifier: Apache-2.0
// Third stage of the histogram cascade: colour co-occurrences of the windows that passed the first two (thesis Sec.
// 3.4.2; ).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/histogram.hpp"

namespace takt::object_detection {

/// Equal, bit for bit, to counting all pairs of a window and comparing all bins. Pairs with a colour that no reference
/// of the object has cannot add to its error: only the others are counted. Windows are independent of one another.
/// Memory is taken by the constructor; the rest allocates nothing. One thread at a time.
class CooccurrenceStage {
 public:
  /// `objects`: per object the histograms of its views.
  CooccurrenceStage(const SearchGrid& grid, const PairBins& bins, std::span<const std::vector<Histogram>> objects);

  /// The missing mass of every reference of the object in window 0 .. windows - 1 of the image; valid until the next
  /// call. `bgr`: three channels, of the grid's image size (not checked).
  std::span<const uint32_t> missing(ImageView<const uint8_t> bgr, size_t window, size_t object);

 private:
  struct References {
    std::vector<uint8_t> slot_of_colour;  ///< colours that no reference has come last
    int colours = 0;                      ///< that any has
    std::vector<uint32_t> rows;
    size_t bins = 0;  ///< of a row, padded
    size_t count = 0;
  };
  References gather(const std::vector<Histogram>& views) const;

  SearchGrid grid_;
  PairBins bins_;
  std::vector<References> objects_;
  CooccurrenceCounter counter_;
  std::vector<uint8_t> colours_;
  std::vector<uint32_t> count_, missing_;
};

}  // namespace takt::object_detection
