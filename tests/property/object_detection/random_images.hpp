// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

namespace takt::test {

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  int in(int low, int high) { return low + static_cast<int>(engine_() % static_cast<uint32_t>(high - low + 1)); }
  uint8_t byte() { return static_cast<uint8_t>(engine_()); }

  /// Patches of few colours, some black: bins repeat, as in real images.
  std::vector<uint8_t> image(int width, int height) {
    std::vector<uint8_t> palette(3 * 12);
    for (uint8_t& value : palette) value = byte();
    std::fill_n(palette.begin(), 3, uint8_t{0});
    std::vector<uint8_t> pixels;
    const int patch = in(1, 9);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto colour = static_cast<size_t>((x / patch * 7 + y / patch * 5 + (in(0, 9) == 0)) % 12);
        for (size_t c = 0; c < 3; ++c) pixels.push_back(palette[3 * colour + c]);
      }
    return pixels;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace takt::test
