// SPDX-License-Identifier: Apache-2.0
// The stages in their slow obvious form, for tests: every window counted pixel by pixel or pair by pair, every bin
// compared.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/histogram.hpp"
#include "nodes/object_detection/layout_stage.hpp"

namespace takt::object_detection {

/// The image at a scale, three channels, each pixel by itself: between the four around its middle, in 1/256.
inline std::vector<uint8_t> shrink_reference(ImageView<const uint8_t> bgr, int width, int height) {
  struct Between {
    int first, second, share;
  };
  const auto between = [](int i, int to, int from) -> Between {
    const double position = (i + 0.5) / (static_cast<double>(to) / from) - 0.5;
    const int below = static_cast<int>(std::floor(position));
    if (below < 0) return {0, 0, 0};
    if (below >= from - 1) return {from - 1, from - 1, 0};
    return {below, below + 1, static_cast<int>(std::nearbyint((position - below) * 256))};
  };
  std::vector<uint8_t> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Between across = between(x, width, bgr.width), down = between(y, height, bgr.height);
      for (int c = 0; c < 3; ++c) {
        const int upper = (256 - across.share) * bgr.at(across.first, down.first, c) +
                          across.share * bgr.at(across.second, down.first, c);
        const int lower = (256 - across.share) * bgr.at(across.first, down.second, c) +
                          across.share * bgr.at(across.second, down.second, c);
        pixels.push_back(static_cast<uint8_t>(((256 - down.share) * upper + down.share * lower + 0x8000) >> 16));
      }
    }
  }
  return pixels;
}

/// Colours of the pixels in the window of `side` px at (x0, y0).
inline std::vector<uint32_t> colour_window_reference(ImageView<const uint8_t> bgr, int x0, int y0, int side,
                                                     ColourBins bins) {
  std::vector<uint32_t> count(kColourBins);
  for (int y = y0; y < y0 + side; ++y)
    for (int x = x0; x < x0 + side; ++x) ++count[colour_bin(bgr.at(x, y, 0), bgr.at(x, y, 1), bgr.at(x, y, 2), bins)];
  return count;
}

/// Missing masses, windows x references, as ColourStage gives them.
inline std::vector<uint16_t> colour_stage_reference(const SearchGrid& grid, ColourBins bins,
                                                    const std::vector<std::vector<Histogram>>& objects,
                                                    ImageView<const uint8_t> bgr) {
  std::vector<uint16_t> missing;
  for (int v = 0; v < grid.rows; ++v) {
    for (int u = 0; u < grid.columns; ++u) {
      const auto histogram = colour_window_reference(bgr, grid.x0(u), grid.y0(v), grid.window_px, bins);
      for (const auto& views : objects)
        for (const Histogram& view : views)
          missing.push_back(static_cast<uint16_t>(missing_mass(histogram, view.count)));
    }
  }
  return missing;
}

/// Orientation index of pixel (x, y), thesis Eq. 3.12 and 3.13 as printed; -1 where there is none.
inline int orientation_reference(ImageView<const uint8_t> bgr, int x, int y, int orientations) {
  if (x < 1 || y < 1 || x + 1 >= bgr.width || y + 1 >= bgr.height) return -1;
  constexpr int kAcross[3][3] = {{1, 0, -1}, {2, 0, -2}, {1, 0, -1}};
  int gx = 0, gy = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const int value =
          std::max({bgr.at(x - i, y - j, 0), bgr.at(x - i, y - j, 1), bgr.at(x - i, y - j, 2)});  // a convolution
      gx += kAcross[j + 1][i + 1] * value;
      gy += kAcross[i + 1][j + 1] * value;
    }
  }
  if (std::hypot(gx, gy) < OrientationBins::kShortest) return -1;
  const double turn = std::atan2(gy, gx) / (2 * std::numbers::pi);
  // Only multiples of 45 degrees lie on a border; rounding must not take them off it.
  return static_cast<int>(std::floor((turn < 0 ? turn + 1 : turn) * orientations + 1e-9)) % orientations;
}

/// Orientations of the pixels in the window of `side` px at (x0, y0).
inline std::vector<uint32_t> orientation_window_reference(ImageView<const uint8_t> bgr, int x0, int y0, int side,
                                                          int orientations) {
  std::vector<uint32_t> count(static_cast<size_t>(orientations));
  for (int y = y0; y < y0 + side; ++y)
    for (int x = x0; x < x0 + side; ++x)
      if (const int bin = orientation_reference(bgr, x, y, orientations); bin >= 0) ++count[static_cast<size_t>(bin)];
  return count;
}

/// Co-occurrences of a square of colours in the order of pair_bin: every pixel with every offset of a half plane.
inline std::vector<uint32_t> cooccurrence_reference(const std::vector<uint8_t>& colour, int side,
                                                    const PairBins& bins) {
  std::vector<uint32_t> count(pair_bins(bins.colours, bins.distances));
  for (int dy = 0; dy <= bins.distances; ++dy) {
    for (int dx = dy == 0 ? 1 : -bins.distances; dx <= bins.distances; ++dx) {
      const auto k = static_cast<int>(std::lround(std::hypot(dx, dy)));
      if (k > bins.distances) continue;
      for (int y = 0; y + dy < side; ++y) {
        for (int x = std::max(0, -dx); x < side - std::max(0, dx); ++x) {
          const int a = colour[static_cast<size_t>(y * side + x)],
                    b = colour[static_cast<size_t>((y + dy) * side + x + dx)];
          if (a >= bins.colours || b >= bins.colours) continue;
          ++count[pair_bin(std::min(a, b), std::max(a, b), k, bins.colours, bins.distances)];
        }
      }
    }
  }
  return count;
}

/// The same of a window.
inline std::vector<uint32_t> cooccurrence_window_reference(ImageView<const uint8_t> bgr, int x0, int y0, int side,
                                                           const PairBins& bins) {
  std::vector<uint8_t> colour;
  for (int y = y0; y < y0 + side; ++y)
    for (int x = x0; x < x0 + side; ++x)
      colour.push_back(pair_colour(bgr.at(x, y, 0), bgr.at(x, y, 1), bgr.at(x, y, 2), bins.colours));
  return cooccurrence_reference(colour, side, bins);
}

/// Features of a square of an image: each cell counted pixel by pixel.
inline LayoutFeatures layout_reference(ImageView<const uint8_t> bgr, const Placement& at) {
  std::vector<uint32_t> count(kLayoutFeatures);
  std::vector<int> pixels(kLayoutCells * kLayoutCells);
  const auto cell_of = [&](int from_edge) {
    int cell = 0;
    while (from_edge >= std::floor((cell + 1.0) * at.side / kLayoutCells + 0.5)) ++cell;
    return cell;
  };
  for (int y = at.y; y < at.y + at.side; ++y) {
    for (int x = at.x; x < at.x + at.side; ++x) {
      const auto cell = static_cast<size_t>(cell_of(y - at.y) * kLayoutCells + cell_of(x - at.x));
      ++pixels[cell];
      ++count[cell * kLayoutBins + pair_colour(bgr.at(x, y, 0), bgr.at(x, y, 1), bgr.at(x, y, 2), kLayoutColours)];
      if (const int bin = orientation_reference(bgr, x, y, 2 * kLayoutOrientations); bin >= 0)
        ++count[cell * kLayoutBins + static_cast<size_t>(kLayoutColours + bin % kLayoutOrientations)];
    }
  }
  LayoutFeatures features;
  for (size_t i = 0; i < kLayoutFeatures; ++i) features[i] = layout_feature(count[i], pixels[i / kLayoutBins]);
  return features;
}

/// What LayoutStage finds around a window: every square counted anew, sums in 64 bits.
inline LayoutStage::Fit layout_fit_reference(ImageView<const uint8_t> bgr, const std::vector<Placement>& squares,
                                             const std::vector<LayoutTemplate>& views) {
  float most = -std::numeric_limits<float>::infinity();
  LayoutStage::Fit best;
  for (const Placement& at : squares) {
    const LayoutFeatures features = layout_reference(bgr, at);
    for (const LayoutTemplate& view : views) {
      int64_t sum = 0;
      for (size_t i = 0; i < kLayoutFeatures; ++i) sum += int64_t{view.weight[i]} * features[i];
      if (const float evidence = view.unit * static_cast<float>(sum - view.middle); evidence > most)
        most = evidence, best.at = at;
    }
  }
  best.error = most > 0 ? kLayoutEvidence / (kLayoutEvidence + most) : 1;
  return best;
}

}  // namespace takt::object_detection
