// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/stereo/aligned_rows.hpp"

namespace takt::object_detection {

/// The histograms of the windows of a grid, exactly and with each pixel looked at once.
///
/// The borders of all windows cut the image into vertical strips and horizontal bands (of 16 pixels each at the default
/// grid). A band's pixels are counted when the first window comes that covers it, by cells, a histogram for each strip.
/// Per strip the cells of the bands that the present row of windows covers are added up: the next row adds the bands
/// that come and takes away those that go; the next window of a row does the same with strips. The work is the same for
/// every image. Memory is taken by the constructor: a histogram for each strip of as many bands as a window covers.
class WindowHistograms {
 public:
  /// `slots`: indices run from 0 to slots - 1.
  WindowHistograms(const SearchGrid& grid, size_t slots);

  /// A new image: nothing of it is counted.
  void begin() { forget(0); }
  /// To the first window of a row, 0 .. rows - 1. Going down costs what is new there, going up a new start.
  void go_to_row(int row);
  /// Histogram of the next window of the row, padded with zeros to a multiple of kLaneBlock; valid until the next call.
  /// At most `columns` times. Bands that come are asked for by index_rows(from, to, index), which writes the slots of
  /// the rows from .. to - 1, one after another.
  template <class IndexRows>
  std::span<const uint16_t> next(const IndexRows& index_rows) {
    if (u_ == 0) leave_bands_above();
    for (; end_ < end_band_[v_]; ++end_) {
      index_rows(y_edges_[end_], y_edges_[end_ + 1], index_.data());
      count_band();
    }
    return slide();
  }

 private:
  size_t strips() const { return x_edges_.size() - 1; }
  uint16_t* cells(size_t band) { return cells_.data() + band % kept_bands_ * strips() * slots_; }
  void forget(size_t first_band);
  void leave_bands_above();
  void count_band();
  template <size_t kAbreast>
  void count_strips(size_t first);
  std::span<const uint16_t> slide();

  SearchGrid grid_;
  size_t slots_;                                 ///< padded
  std::vector<int> x_edges_, y_edges_;           ///< strip or band i is edge i .. edge i + 1
  std::vector<size_t> first_strip_, end_strip_;  ///< of the windows of each column
  std::vector<size_t> first_band_, end_band_;    ///< of the windows of each row
  size_t kept_bands_ = 0;
  std::vector<uint16_t> index_;
  stereo::Buffer<uint16_t> cells_, strips_, window_;
  size_t first_ = 0, end_ = 0;  ///< bands that strips_ has
  size_t u_ = 0, v_ = 0;        ///< window that next() comes to
};

}  // namespace takt::object_detection
