// SPDX-License-Identifier: Apache-2.0
// Internal: pixels of images that lie in the host's memory.
#pragma once
#include <cstdint>

namespace takt::cuda {

/// Up to four neighbours of a row, channel after channel in each, 1 or 3 of them: in words where row and memory allow,
/// since each access crosses the bus.
struct FourPixels {
  uint32_t words[3];
  int channels;

  __device__ FourPixels(const uint8_t* from, int count, int channels) : words{}, channels(channels) {
    auto* in = reinterpret_cast<uint8_t*>(words);
    if (count == 4 && reinterpret_cast<uintptr_t>(from) % 4 == 0)
      for (int i = 0; i < channels; ++i) words[i] = reinterpret_cast<const uint32_t*>(from)[i];
    else
      for (int i = 0; i < count * channels; ++i) in[i] = from[i];
  }
  __device__ const uint8_t* operator[](int i) const { return reinterpret_cast<const uint8_t*>(words) + i * channels; }
};

}  // namespace takt::cuda
