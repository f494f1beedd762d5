// SPDX-License-Identifier: Apache-2.0
// Loops over the counts of histograms, vectorised.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace takt::object_detection {

constexpr size_t kLaneBlock = 32;  ///< histograms are padded with zeros to a multiple of the widest vector of 16 bits
constexpr size_t kByteBlock = 64;  ///< the same of 8 bits

/// Of each slot, modulo 2^16. `slots`: a multiple of kLaneBlock.
void add_counts(uint16_t* counts, const uint16_t* come, size_t slots);
void subtract_counts(uint16_t* counts, const uint16_t* gone, size_t slots);
/// bytes[i] = min(255, counts[i]). Size: a multiple of kLaneBlock.
void saturate_counts(std::span<const uint16_t> counts, uint8_t* bytes);

/// out[r] = sum of max(0, reference - window) for each of `references` rows of `bins` counts (a multiple of
/// kLaneBlock). The sum of a row must be below 2^32.
void missing_masses(const uint32_t* window, const uint32_t* reference_rows, size_t bins, size_t references,
                    uint32_t* out);
/// The same of bytes: a row has, one after another, the blocks of kByteBlock bytes that in the window begin at
/// `blocks`. The sum of a row must be below 65,536.
void missing_masses(const uint8_t* window, std::span<const size_t> blocks, const uint8_t* reference_rows,
                    size_t references, uint16_t* out);

}  // namespace takt::object_detection
