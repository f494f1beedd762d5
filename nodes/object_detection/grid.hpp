// SPDX-License-Identifier: Apache-2.0
// Where the search windows lie (thesis Eq. 3.16, 3.17, corrected: and C-8).
#pragma once
#include <cstddef>

namespace takt::object_detection {

/// A square of an image, px.
struct Placement {
  int x = 0, y = 0, side = 0;
};

/// Square windows in rows and columns over an image. Window (u, v) covers `window_px` pixels to the right of x0(u) and
/// below y0(v); the last ones touch the border. Every square of `reference_px` lies completely in at least one window.
struct SearchGrid {
  int image_width = 0, image_height = 0;
  int window_px = 0;
  int columns = 0, rows = 0;

  int windows() const { return columns * rows; }
  /// Window number i, row by row.
  Placement window(size_t i) const {
    const auto n = static_cast<int>(i);
    return {x0(n % columns), y0(n / columns), window_px};
  }
  int x0(int u) const { return origin(u, columns, image_width); }
  int y0(int v) const { return origin(v, rows, image_height); }

 private:
  /// round(i (size - window) / (count - 1))
  int origin(int i, int count, int size) const {
    return count == 1 ? 0 : (2 * i * (size - window_px) + count - 1) / (2 * (count - 1));
  }
};

/// The fewest windows that overlap by at least the reference's size: n = 1 + ceil((image - window) / (window -
/// reference)). 640 x 480, references of 48 px, windows of 64 px: 37 x 27 at a stride of exactly 16. Throws
/// std::invalid_argument unless 1 <= reference < window <= 255 (a window's pixels must fit 16-bit counters) and the
/// window fits the image.
SearchGrid make_search_grid(int image_width, int image_height, int reference_px, int window_px);

}  // namespace takt::object_detection
