// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace takt::stereo {

/// Colour filter of a raw image, named by its first four pixels: two of row 0, then two of row 1, from the left.
enum class BayerPattern : uint8_t { none, rggb, bggr, grbg, gbrg };

/// What lies under one row of a colour filter: green at every other pixel, and one more colour.
struct MosaicRow {
  bool red = false;          ///< the other colour is red, else blue
  bool green_first = false;  ///< pixel 0 is green
};

/// Row `y` of a pattern other than none.
constexpr MosaicRow mosaic_row(BayerPattern pattern, int y) {
  const bool odd = y % 2 != 0;
  const bool red = pattern == BayerPattern::rggb || pattern == BayerPattern::grbg;
  const bool green_first = pattern == BayerPattern::grbg || pattern == BayerPattern::gbrg;
  return {red != odd, green_first != odd};
}

}  // namespace takt::stereo
