// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::object_detection {

constexpr size_t kPixelBlock = 64;  ///< rows of pixels are padded to a multiple of the widest vector of bytes
constexpr size_t kPartialSums = kPixelBlock / sizeof(uint64_t);

/// For half widths w = 0 .. widest, out[w * width + x] = pixels x - w .. x + w of the row that have this colour, modulo
/// 256. `row` must be readable from -widest to width + widest; `width` is a multiple of kPixelBlock.
void run_lengths(const uint8_t* row, uint8_t colour, size_t width, int widest, uint8_t* out);

/// A row of pixels and the colour b that is looked for around them.
struct RingRow {
  const uint8_t* colours;  ///< of the row, with a margin of `distances` to the right
  size_t width;            ///< a multiple of kPixelBlock
  uint8_t b;
  uint32_t present;      ///< the colours of the row, one bit each
  int distances, below;  ///< rows below that there are
  const uint8_t* runs;   ///< run lengths of b, from those of this row on
  const size_t* run_of;  ///< for k = 1, 2 ... the offsets of the runs of a disc of radius k in the k rows below
};

/// For each colour a of the row: pixels of colour b at distance k, below or to the right, over all pixels of colour a;
/// their sum over the kPartialSums numbers from sums[(a * distances + k - 1) * kPartialSums] grows by that.
void add_rings(const RingRow& row, uint64_t* sums);

}  // namespace takt::object_detection
