// SPDX-License-Identifier: Apache-2.0
// Internal: what the kernels of a co-occurrence stage work on.
#pragma once
#include <cstddef>
#include <cstdint>

#include "nodes/cuda/table.hpp"

namespace takt::cuda {

constexpr int kLanes = 32;

struct CardReferences {
  int colours, views;
  size_t bins;                    ///< of a view
  const uint8_t* colour_of_slot;  ///< rising
  const uint32_t* rows;           ///< views x bins
};

/// Lane `lane` counts the offsets of two rings at most, or parts of them: one in the lower half of its bins, one in the
/// upper.
struct CardOffset {
  int16_t at;     ///< dy * pitch + dx
  uint8_t below;  ///< dy; kNoOffset: there is none
  uint8_t half;   ///< 0 or 1
};
constexpr uint8_t kNoOffset = 255;
/// Half a bin of a lane, whose number is that of a ring.
struct CardShare {
  uint8_t lane, half;
};

struct CooccurrenceWork {
  int width, height, side, colours, distances, most_views;
  size_t bins;                 ///< of a histogram of all colours
  int rows;                    ///< of a window that a block counts at once, at most
  int pitch;                   ///< of a row in shared memory, with its surroundings
  int steps;                   ///< most offsets of a lane
  const CardOffset* offsets;   ///< steps x kLanes, of a lane those of few rows first
  const CardShare* shares;     ///< ring by ring
  const uint8_t* first_share;  ///< of each distance 1 .. distances + 1
  const CardReferences* objects;
  uint8_t* colour;   ///< of each pixel
  uint32_t* counts;  ///< windows x bins
  uint32_t* found;   ///< questions x most_views
  const CooccurrenceCall* call;
  const bool* withdrawn;
};

}  // namespace takt::cuda
