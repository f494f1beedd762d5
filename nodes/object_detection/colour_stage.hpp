// SPDX-License-Identifier: Apache-2.0
// First stage of the histogram cascade: the colour histogram of every search window against those of all references
// (thesis Sec. 3.4.2; ).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/byte_references.hpp"
#include "nodes/object_detection/histogram.hpp"
#include "nodes/object_detection/window_histograms.hpp"

namespace takt::object_detection {

/// Equal, bit for bit, to counting each window's pixels and comparing all bins. Only bins that a reference of the
/// object uses can add to its error, so only those are counted and compared. Memory is taken by the constructor; the
/// rest allocates nothing and does the same work for every image. One thread at a time.
class ColourStage {
 public:
  static constexpr uint16_t kNotSearched = UINT16_MAX;  ///< missing mass in a window that was left out

  /// `objects`: per object the histograms of its views; each must have mass. Throws std::invalid_argument otherwise.
  ColourStage(const SearchGrid& grid, ColourBins bins, std::span<const std::vector<Histogram>> objects);

  /// `bgr`: three channels, of the grid's image size (not checked). All windows.
  void run(ImageView<const uint8_t> bgr);
  /// The same in portions: no window is searched yet, and search_row() begins at that row of windows, 0 .. rows - 1.
  /// Windows whose `wanted` is 0 are left out. The image, and `wanted` if not empty, must stay until the last
  /// search_row().
  void begin(ImageView<const uint8_t> bgr, int first_row, std::span<const uint8_t> wanted = {});
  /// Searches the next row of windows, after the last one row 0, and returns which one; at most once per row.
  int search_row();

  size_t references() const { return references_.references(); }
  /// The missing mass of every reference, object by object, for window 0, 1 ... (row by row).
  std::span<const uint16_t> missing() const { return missing_; }

 private:
  size_t assign_slots(std::span<const std::vector<Histogram>> objects);
  std::vector<std::vector<ByteReferences::Counts>> by_slot(std::span<const std::vector<Histogram>> objects) const;
  void index_rows(int from, int to, uint16_t* index) const;

  SearchGrid grid_;
  ColourBins bins_;
  ImageView<const uint8_t> image_;
  int row_ = 0;  ///< that search_row() comes to next
  std::span<const uint8_t> wanted_;
  std::vector<uint16_t> slot_of_bin_;  ///< the last slot takes the bins that no reference uses
  size_t slots_;
  ByteReferences references_;
  WindowHistograms windows_;
  std::vector<uint16_t> missing_;
};

}  // namespace takt::object_detection
