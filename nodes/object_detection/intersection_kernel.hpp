// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::object_detection {

constexpr size_t kLaneBlock = 32;  ///< histograms are padded with zeros to a multiple of the widest vector of 16 bits

/// out[r] = sum of max(0, reference - window) for each of `references` rows of `bins` counts (a multiple of
/// kLaneBlock). The sum of a row must be below 65,536.
void missing_masses(const uint16_t* window, const uint16_t* reference_rows, size_t bins, size_t references,
                    uint16_t* out);
/// The same with sums below 2^32.
void missing_masses(const uint32_t* window, const uint32_t* reference_rows, size_t bins, size_t references,
                    uint32_t* out);

}  // namespace takt::object_detection
