// SPDX-License-Identifier: Apache-2.0
// How much a pixel looks like a corner between the squares of a chessboard. A ring of 16 pixels around such a corner is
// bright, dark, bright and dark: opposite pixels are equal, those a quarter turn apart are not; and it is as bright as
// its middle, which on an edge or a line it is not (Bennett, Lasenby, "ChESS: quick and robust detection of chess-board
// features", 2014, here with a ring of radius 3 for squares of four pixels and more).
#pragma once
#include <array>
#include <cstdint>

#include "rt/msg/image_view.hpp"

namespace takt::person_tracking {

struct RingOffset {
  int x, y;
};
/// Clockwise, beginning above; an eighth of a turn are two, with 22.5 degrees from one to the next but for rounding.
constexpr int kRingRadius = 3;
constexpr std::array<RingOffset, 16> kRing{{{0, -3},
                                            {1, -3},
                                            {2, -2},
                                            {3, -1},
                                            {3, 0},
                                            {3, 1},
                                            {2, 2},
                                            {1, 3},
                                            {0, 3},
                                            {-1, 3},
                                            {-2, 2},
                                            {-3, 1},
                                            {-3, 0},
                                            {-3, -1},
                                            {-2, -2},
                                            {-1, -3}}};

/// The response of one pixel of a grey image, which lies kRingRadius from its edges at least: 0 .. 2040.
///   max(0, sum_{n<4} |(I_n + I_{n+8}) - (I_{n+4} + I_{n+12})| - sum_{n<8} |I_n - I_{n+8}| - |sum I_n - 4 sum
///   I_beside|)
inline int saddle_response(ImageView<const uint8_t> grey, int x, int y) {
  const auto ring = [&](size_t n) { return int{grey.at(x + kRing[n].x, y + kRing[n].y)}; };
  const auto magnitude = [](int v) { return v < 0 ? -v : v; };
  int saddle = 0, line = 0, sum = 0;
  for (size_t n = 0; n < 4; ++n) saddle += magnitude(ring(n) + ring(n + 8) - ring(n + 4) - ring(n + 12));
  for (size_t n = 0; n < 8; ++n) line += magnitude(ring(n) - ring(n + 8));
  for (size_t n = 0; n < 16; ++n) sum += ring(n);
  const int beside = grey.at(x - 1, y) + grey.at(x + 1, y) + grey.at(x, y - 1) + grey.at(x, y + 1);
  const int response = saddle - line - magnitude(sum - 4 * beside);
  return response > 0 ? response : 0;
}

/// Elements that saddle_row() may touch beyond a row's end, in the image and in `out`.
constexpr int kRowSlack = 128;

/// The responses of row y, kRingRadius from the first and last row at least; 0 where the ring leaves the row.
void saddle_row(ImageView<const uint8_t> grey, int y, int16_t* out);

/// Grey of `count` BGR pixels: (b + 2 g + r + 2) / 4. May write kRowSlack elements more.
void grey_row(const uint8_t* bgr, int count, uint8_t* out);

}  // namespace takt::person_tracking
