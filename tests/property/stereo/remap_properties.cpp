// SPDX-License-Identifier: Apache-2.0
// The vectorised resampling against the bilinear formula in integers, on every SIMD target.
#include <doctest/doctest.h>
#include <hwy/targets.h>

#include <random>
#include <vector>

#include "nodes/stereo/remap_kernel.hpp"

using namespace takt::stereo;

TEST_CASE("resampling equals the integer formula and touches nothing beyond the row") {
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    std::mt19937 random(3);
    const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    for (int round = 0; round < 300; ++round) {
      const int w = pick(2, 20), h = pick(2, 12), n = pick(0, 1) ? 3 : 1, count = pick(1, 40);
      std::vector<uint8_t> image(static_cast<size_t>(w * h * n));  // no spare byte behind it: sanitizers see an overrun
      for (auto& v : image) v = static_cast<uint8_t>(pick(0, 3) ? pick(0, 255) : 255);
      std::vector<RemapSource> sources(static_cast<size_t>(count));
      for (auto& s : sources) {
        if (pick(0, 9) == 0) continue;  // outside
        s.x = static_cast<int16_t>(pick(0, w - 2));
        s.y = static_cast<int16_t>(pick(0, h - 2));
        s.fraction_x = static_cast<uint8_t>(pick(0, 4) ? pick(0, 128) : 128 * pick(0, 1));
        s.fraction_y = static_cast<uint8_t>(pick(0, 4) ? pick(0, 128) : 128 * pick(0, 1));
      }
      std::vector<uint8_t> out(static_cast<size_t>(count * n + 4), 0xA5);
      remap_row()({image.data(), ptrdiff_t{w} * n, w, h, n}, sources.data(), count, out.data());
      for (int i = 0; i < count; ++i)
        for (int c = 0; c < n; ++c) {
          const RemapSource& s = sources[static_cast<size_t>(i)];
          int expected = 0;
          if (s.x >= 0) {
            const auto at = [&](int x, int y) { return image[static_cast<size_t>(((s.y + y) * w + s.x + x) * n + c)]; };
            const int fx = s.fraction_x, fy = s.fraction_y;
            expected = (at(0, 0) * (128 - fx) * (128 - fy) + at(1, 0) * fx * (128 - fy) + at(0, 1) * (128 - fx) * fy +
                        at(1, 1) * fx * fy + 8192) >>
                       14;
          }
          REQUIRE(out[static_cast<size_t>(i * n + c)] == expected);
        }
      for (size_t i = out.size() - 4; i < out.size(); ++i) REQUIRE(out[i] == 0xA5);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}
