// SPDX-License-Identifier: Apache-2.0
// Image preparation of the stages that look at colour: each pixel's indices I_ch (R-6.1, bins after
// C-7) and I_cch.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace takt::object_detection {

/// How bins, 4,096 or for comparisons fewer, are split over hue, saturation and value. Value gets few: light changes
/// it, and it alone.
enum class ColourBins : uint8_t { hsv_64x32x2, hsv_64x64x1, hsv_32x32x1, hsv_16x16x1, hsv_8x4x1 };
constexpr int kColourBins = 4096;  ///< at most

struct BinSplit {
  int hue, saturation, value;
};
constexpr BinSplit split_of(ColourBins bins) {
  constexpr BinSplit kSplits[] = {{64, 32, 2}, {64, 64, 1}, {32, 32, 1}, {16, 16, 1}, {8, 4, 1}};
  return kSplits[static_cast<size_t>(bins)];
}

/// Whole numbers: hue / spread is the position on the colour circle in sixths of a turn, spread / high the saturation.
struct Hsv {
  int hue, spread, high;

  constexpr Hsv(int b, int g, int r) : hue(0), spread(0), high(std::max(b, std::max(g, r))) {
    spread = high - std::min(b, std::min(g, r));
    hue = high == r ? g - b : high == g ? 2 * spread + b - r : 4 * spread + r - g;
    if (hue < 0) hue += 6 * spread;
  }
  /// floor(`parts` hue / turn)
  constexpr int hue_part(int parts) const { return spread == 0 ? 0 : parts * hue / (6 * spread); }
};

/// Index (h * nS + s) * nV + v of one colour, in exact integers: h = floor(nH H / 360 degrees), s = floor(nS S) (S = 1
/// belongs to the last bin), v = floor(nV V / 256). Grey has H = 0, black S = 0.
uint16_t colour_bin(uint8_t blue, uint8_t green, uint8_t red, ColourBins bins);

/// The same for `count` interleaved BGR pixels, vectorised; equal to colour_bin for every colour.
void colour_bins(const uint8_t* bgr, size_t count, ColourBins bins, uint16_t* index);

/// How the few colours of the co-occurrence stage, 5 or 20, are told apart: black where the value is small, greys
/// where the saturation is, else hues.
///
///     20   0 V < 0.15; S < 0.15: 1 V < 0.45, 2 V < 0.8, 3 brighter; 4 + floor(16 H / 360 degrees)
///      5   0 V < 0.2;  S < 0.2: 1;                                  2 + floor(3 H / 360 degrees)
struct PairColourSplit {
  int black_below, grey_below, mid_from, bright_from;  ///< V in 8 bit; S in twentieths
  int first_hue, hues;
};
constexpr PairColourSplit pair_split_of(int colours) {
  constexpr int kNever = 256;
  return colours == 20 ? PairColourSplit{39, 3, 115, 204, 4, 16} : PairColourSplit{51, 4, kNever, kNever, 2, 3};
}
/// Index of one colour among them.
constexpr uint8_t pair_colour(uint8_t blue, uint8_t green, uint8_t red, int colours) {
  const PairColourSplit split = pair_split_of(colours);
  const Hsv c(blue, green, red);
  if (c.high < split.black_below) return 0;
  if (20 * c.spread < split.grey_below * c.high)
    return static_cast<uint8_t>(1 + (c.high >= split.mid_from) + (c.high >= split.bright_from));
  return static_cast<uint8_t>(split.first_hue + c.hue_part(split.hues));
}

/// The same for `count` interleaved BGR pixels, vectorised; equal to pair_colour for every colour.
void pair_colours(const uint8_t* bgr, size_t count, int colours, uint8_t* index);

}  // namespace takt::object_detection
