// SPDX-License-Identifier: Apache-2.0
// Internal: the vectorised inner part of semi-global matching. One row; disparity is the vector axis, all costs are
// bytes. The recursion along a path is
//     L(x, d) = C(x, d) + min(L'(d), L'(d - 1) + p1, L'(d + 1) + p1, m + p2) - m,   m = min over e of L'(e),
// L' the costs of the pixel before, so that L stays below c_max + p2; 3 (c_max + p2) <= 255 keeps the sum of three
// paths in a byte.
#pragma once
#include <cstdint>

#include "nodes/stereo/cost_planes.hpp"

namespace takt::stereo {

struct PathRow {
  int width = 0;
  int disparities = 0;
  int vectors = 0;  ///< byte vectors of one pixel: the search range, rounded up
  uint8_t c_max = 0, p1 = 0, p2 = 0;
  int uniqueness = 0;
  bool subpixel = false;

  const uint8_t* left[kMaxPlanes] = {};   ///< census bytes of the row
  const uint8_t* right[kMaxPlanes] = {};  ///< of the other row, mirrored: element width - 1 - x + d is pixel x - d
  const uint8_t* outside = nullptr;       ///< like right: c_max where the pixel lies outside the image, else 0
  const uint8_t* beyond = nullptr;        ///< element d: 255 outside the search range, else 0

  // `vectors` vectors for each pixel.
  uint8_t* costs = nullptr;        ///< matching costs
  uint8_t* above_least = nullptr;  ///< its minima, a byte a pixel
  uint8_t* sums = nullptr;         ///< paths from the left and from above

  // The path from above at the row before (zero at the first) and, out, at this row. Of a pixel as many bytes as
  // `vectors` have and, if the search range fills them, a vector more of 255; before the first pixel is 255, too.
  const uint8_t* above = nullptr;
  uint8_t* above_here = nullptr;
  ptrdiff_t above_stride = 0;

  // Scratch, one pixel each.
  uint8_t *from_left = nullptr, *from_right = nullptr, *totals = nullptr;

  int16_t* fine = nullptr;       ///< out: disparity << 6 | fraction
  uint8_t* least = nullptr;      ///< out: the winner's total
  uint8_t* ambiguous = nullptr;  ///< out: 1 if the second best total is not far enough above (uniqueness)
};

/// The functions of one SIMD target.
struct PathKernels {
  const char* target;
  int lanes;  ///< bytes of a vector
  /// Paths from the left and from above along the next row, and the one from the right with the winners along the row
  /// before, which must have been `next` already; null: none. Neither reads what the other writes.
  void (*run_rows)(const PathRow* next, const PathRow* finished);
};

const PathKernels& path_kernels();

}  // namespace takt::stereo
