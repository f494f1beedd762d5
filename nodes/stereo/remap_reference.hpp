// SPDX-License-Identifier: Apache-2.0
// The slow, obvious debayering and resampling: the definitions that the fast ones must reproduce bit for bit. For
// tests.
#pragma once
#include <span>
#include <vector>

#include "nodes/stereo/debayer.hpp"
#include "nodes/stereo/remap.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo::reference {

/// Bilinear: a colour that a pixel lacks is the mean of those of its eight neighbours that have it, rounded, halves up.
/// Beyond the edges the mosaic is mirrored at the outermost pixel (-1 is 1), so that colours keep their places. At
/// least 2 x 2 pixels; `bgr` has the size of `mosaic`.
inline void debayer(ImageView<const uint8_t> mosaic, BayerPattern pattern, ImageView<uint8_t> bgr) {
  constexpr int kBlue = 0, kGreen = 1, kRed = 2;
  const auto colour_at = [&](int x, int y) {
    const MosaicRow row = mosaic_row(pattern, y);
    const bool green = (x % 2 == 0) == row.green_first;
    return green ? kGreen : row.red ? kRed : kBlue;
  };
  const auto mirrored = [](int i, int size) { return i < 0 ? -i : i >= size ? 2 * (size - 1) - i : i; };
  for (int y = 0; y < mosaic.height; ++y)
    for (int x = 0; x < mosaic.width; ++x)
      for (const int colour : {kBlue, kGreen, kRed}) {
        int sum = 0, count = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int nx = mirrored(x + dx, mosaic.width), ny = mirrored(y + dy, mosaic.height);
            if (colour_at(nx, ny) != colour) continue;
            sum += mosaic.at(nx, ny);
            ++count;
          }
        if (colour_at(x, y) == colour) sum = mosaic.at(x, y), count = 1;
        bgr.at(x, y, colour) = static_cast<uint8_t>((sum + count / 2) / count);
      }
}

/// out(i, j) = the four pixels of its source, weighted; 0 where it has none.
inline void remap(std::span<const RemapSource> sources, ImageView<const uint8_t> in, ImageView<uint8_t> out) {
  size_t i = 0;
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x, ++i)
      for (int c = 0; c < out.channels; ++c) {
        const RemapSource& s = sources[i];
        int sum = 0;
        if (s.x >= 0) {
          const int fx = s.fraction_x, fy = s.fraction_y;
          sum = (in.at(s.x, s.y, c) * (128 - fx) + in.at(s.x + 1, s.y, c) * fx) * (128 - fy) +
                (in.at(s.x, s.y + 1, c) * (128 - fx) + in.at(s.x + 1, s.y + 1, c) * fx) * fy;
        }
        out.at(x, y, c) = static_cast<uint8_t>((sum + 8192) >> 14);
      }
}

}  // namespace takt::stereo::reference
