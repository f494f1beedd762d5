// SPDX-License-Identifier: Apache-2.0
// Clean-up of the mask of single pixels (thesis Sec. 4.2.1; ): box average, then only what hangs
// together with the reference area.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/ground_map/texture.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::ground_map {

/// Allocates in the constructor only.
class MaskCleaner {
 public:
  /// mean_size odd, 1..31.
  MaskCleaner(int width, int height, int mean_size);
  /// From the next clean() on; as the constructor wants it.
  void tune(int mean_size);

  /// `raw` 1 ground, 0 not. `mask` gets 255 where more than half of the window (cut at the image's edge) is ground and
  /// a path of such pixels along rows and columns leads to the area, else 0. Both of the constructor's size.
  void clean(ImageView<const uint8_t> raw, const ReferenceArea& area, ImageView<uint8_t> mask);

 private:
  struct Run {
    int32_t y, first, last;  ///< pixels first .. last - 1
  };
  void average(ImageView<const uint8_t> raw);
  void reach(const Run& along, ImageView<uint8_t> mask);
  uint8_t* row(int y) { return waiting_ground_.data() + static_cast<ptrdiff_t>(y) * width_; }

  static constexpr int kLargest = 31;

  int width_, height_, radius_ = 0;
  std::vector<uint8_t> waiting_ground_;  ///< 1: ground of the averaged image that was not reached yet
  std::vector<int16_t> columns_;         ///< ground pixels of each column within the window's rows
  std::vector<int16_t> sums_;            ///< of neighbouring columns
  std::vector<int16_t> within_;          ///< columns of the window that lie in the image
  std::vector<Run> runs_;                ///< reached, with rows above and below still to be looked at
};

}  // namespace takt::ground_map
