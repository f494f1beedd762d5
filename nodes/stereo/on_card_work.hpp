// SPDX-License-Identifier: Apache-2.0
// Internal: what the kernels of a matcher work on.
#pragma once
#include "nodes/cuda/table.hpp"

namespace takt::cuda {

constexpr int kGroup = 4;  ///< disparities in a word of the volume

enum Cost : int32_t { kGradient, kSsd, kSad, kCensus };

/// Of one image.
struct Features {
  uint8_t* pixels;   ///< grey, or channel after channel
  uint8_t* bytes;    ///< derivatives along x, then along y, plus 128; else the pixels
  uint64_t* census;  ///< the 48 bits
};

struct Work {
  StereoShape shape;
  int groups;  ///< of kGroup disparities
  Features left, right;
  void* volume;
  uint32_t *keys, *left_keys, *right_keys;
  const StereoCall* call;  ///< read on the card with each match
  const bool* withdrawn;   ///< on the card: what was found is not written
};

}  // namespace takt::cuda
