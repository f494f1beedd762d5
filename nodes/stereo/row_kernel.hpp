// SPDX-License-Identifier: Apache-2.0
// Internal: the vectorised inner part of the matcher. One row of a strip of columns and a block of disparities.
//
// Disparity is the vector axis. The right row is stored reversed, so that the pixels x - d for rising d follow one
// another, and pair-interleaved: byte 2i is pixel i of the reversed row, byte 2i + 1 is pixel i + lanes. The even bytes
// of a byte vector then are one group of `lanes` consecutive disparities, the odd bytes the next group, and both widen
// to 16 bits with one instruction. A chunk is one byte vector (2 * lanes disparities).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "nodes/stereo/cost_planes.hpp"
#include "nodes/stereo/parameters.hpp"

namespace takt::stereo {

/// Costs whose column sums may fit 8 bits.
constexpr bool may_be_narrow(CostKind kind) { return kind == CostKind::gradient || kind == CostKind::census; }

/// How many 16-bit vectors of sums a block may have so that they stay in registers, largest first. A search range is
/// cut into such blocks; few sizes keep the compile time down.
inline std::span<const int> block_sizes(bool narrow) {
  static constexpr int kNarrow[] = {6, 5, 4, 2, 1}, kWide[] = {5, 2, 1};
  return narrow ? std::span<const int>(kNarrow) : std::span<const int>(kWide);
}

struct RowJob {
  int first_column = 0, last_column = 0;  ///< inclusive; columns of the strip with its halo
  int x_begin = 0, x_end = 0;             ///< pixels to decide
  int image_width = 0;
  int radius = 0;  ///< of the summing window
  int groups = 0;  ///< vectors of 16-bit sums in the block (all of the search range if they stay in memory)
  int first_disparity = 0;
  int disparities = 0;  ///< of the whole search range
  int c_max = 0;
  int uniqueness = 0;        ///< sums in memory only
  bool subpixel = false;     ///< the same
  bool new_row = false;      ///< compute the costs of a row into ring_new and roll the column sums to it
  bool first_block = false;  ///< keys are written; later blocks take the minimum with what is there

  const uint32_t* left[kMaxPlanes] = {};  ///< element column - first_column: the pixel's byte, four times
  const uint8_t* right[kMaxPlanes] = {};  ///< byte 2 * (last_column - column): chunk 0 of that column
  const uint8_t* outside = nullptr;       ///< like right: c_max where the search pixel lies outside the image, else 0
  uint8_t* ring_new = nullptr;            ///< costs of one image row: column after column, chunk after chunk
  const uint8_t* ring_old = nullptr;      ///< costs of the row that leaves the window; may be ring_new
  void* columns = nullptr;         ///< vertical sums, laid out as the ring; 8 bit (narrow) or 16 bit and scaled (wide)
  const uint16_t* tail = nullptr;  ///< one vector: 0xFFFF for the lanes of the last group beyond the search range
  uint16_t* sums = nullptr;        ///< scratch, groups * lanes (sums in memory only)
  uint32_t* winners = nullptr;     ///< scratch, x_end - x_begin
  uint32_t* keys = nullptr;        ///< element x - x_begin: sum << 16 | disparity << 7 | fraction << 1 | ambiguous
};

struct RowFunctions {
  void (*fill)(const RowJob&);    ///< costs of a row into ring_new
  void (*roll)(const RowJob&);    ///< column sums += ring_new - ring_old
  void (*decide)(const RowJob&);  ///< (new_row: fill and roll, fused) then window sums and winners into keys
};

/// The functions of one SIMD target.
struct Kernels {
  const char* target;
  int lanes;  ///< 16-bit lanes of one vector
  /// `narrow`: 8-bit column sums, possible if c_max * n_square <= 255 and may_be_narrow(kind).
  RowFunctions (*rows)(CostKind kind, bool narrow, int groups);
  /// The same with all sums of a pixel in memory, for what looks at more than the smallest: uniqueness and sub-pixel
  /// fit.
  RowFunctions (*rows_in_memory)(CostKind kind, bool narrow);
  /// out[2 i] = reversed[i], out[2 i + 1] = reversed[i + lanes] for i < count; writes up to 2 * lanes elements more.
  void (*interleave)(const uint8_t* reversed, int count, uint8_t* out);
};

/// Bytes of the column sums per byte of the ring.
constexpr size_t column_bytes(bool narrow) { return narrow ? 1 : 2; }

/// The best target of this machine among those enabled (hwy::DisableTargets restricts it).
const Kernels& kernels();

}  // namespace takt::stereo
