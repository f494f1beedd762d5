// SPDX-License-Identifier: Apache-2.0
// Image preparation of the colour stage: each pixel's colour index I_ch (algorithm reference 6.1, bins after 21.7).
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::object_detection {

/// How 4,096 bins are split over hue, saturation and value. Value gets few: light changes it, and it alone.
enum class ColourBins : uint8_t { hsv_64x32x2, hsv_64x64x1 };
constexpr int kColourBins = 4096;

struct BinSplit {
  int hue, saturation, value;
};
constexpr BinSplit split_of(ColourBins bins) {
  return bins == ColourBins::hsv_64x32x2 ? BinSplit{64, 32, 2} : BinSplit{64, 64, 1};
}

/// Index (h * nS + s) * nV + v of one colour, in exact integers: h = floor(nH H / 360 degrees), s = floor(nS S) (S = 1
/// belongs to the last bin), v = floor(nV V / 256). Grey has H = 0, black S = 0.
uint16_t colour_bin(uint8_t blue, uint8_t green, uint8_t red, ColourBins bins);

/// The same for `count` interleaved BGR pixels, vectorised; equal to colour_bin for every colour.
void colour_bins(const uint8_t* bgr, size_t count, ColourBins bins, uint16_t* index);

}  // namespace takt::object_detection
