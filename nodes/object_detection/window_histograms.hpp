// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/grid.hpp"

namespace takt::object_detection {

/// The histograms of all windows of a grid, one after another, exactly and without counting a pixel once per window.
///
/// The borders of all windows cut the image into vertical strips (16 pixels wide at the default grid). Per strip there
/// is a histogram of the rows that the present row of windows covers: the next row of windows adds the rows that come
/// and takes away those that go, so each pixel is counted twice. The next window in a row adds the strips that come and
/// takes away those that go. The work is the same for every image. Memory is taken by the constructor.
class WindowHistograms {
 public:
  /// `slots`: indices run from 0 to slots - 1.
  WindowHistograms(const SearchGrid& grid, size_t slots);

  /// Starts at the first window of that row of windows, 0 .. rows - 1. `index`: image_width x image_height slots, row
  /// by row; must stay until the last next().
  void begin(const uint16_t* index, int row = 0);
  /// Histogram of the next window, row by row to the lower right; valid until the next call. At most as often as there
  /// are windows from there on.
  std::span<const uint16_t> next();
  /// Leaves out the windows of the row that next() has not come to the end of; if it has, those of the row below.
  void skip_rest_of_row();

 private:
  void begin_row_if_due();
  void count_rows(int from, int to, uint16_t change);
  void change_window(size_t from_strip, size_t to_strip, bool add);

  SearchGrid grid_;
  size_t slots_;
  std::vector<int> edges_;                       ///< of the strips: strip i is edges_[i] .. edges_[i + 1]
  std::vector<size_t> first_strip_, end_strip_;  ///< of the windows of each column
  std::vector<uint16_t> strips_, window_;
  const uint16_t* index_ = nullptr;
  int u_ = 0, v_ = 0;
};

}  // namespace takt::object_detection
