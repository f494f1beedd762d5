// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/block_search.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "nodes/ego_motion/block_kernel.hpp"

namespace takt::ego_motion {
namespace {

/// What of a window lies inside the image with its whole squares.
SearchWindow inside(const Plane& image, int half, int x, int y, int radius_x, int radius_y) {
  return {std::max(half, x - radius_x), std::min(image.width() - 1 - half, x + radius_x), std::max(half, y - radius_y),
          std::min(image.height() - 1 - half, y + radius_y)};
}

}  // namespace

void Patch::take(const Level& level, int x, int y, int half_size) {
  half = half_size;
  mean = level.mean.row(y)[x];
  const int size = 2 * half + 1;
  std::array<uint8_t, 16> mask{};
  std::fill_n(mask.begin(), size, uint8_t{0xFF});
  const auto used = std::bit_cast<std::array<uint64_t, 2>>(mask);
  for (int v = 0; v < size; ++v) {
    std::array<uint64_t, 2> row;
    std::memcpy(row.data(), level.image.row(y - half + v) + x - half, 16);
    row[0] &= used[0];
    row[1] = half <= kNarrowHalf ? row[0] : row[1] & used[1];
    std::memcpy(values[v], row.data(), 16);
  }
}

uint32_t sad(const Patch& patch, const Level& level, int x, int y) {
  const int brighter = level.mean.row(y)[x] - patch.mean;
  uint32_t sum = 0;
  for (int v = 0; v <= 2 * patch.half; ++v) {
    const uint8_t* there = level.image.row(y - patch.half + v) + x - patch.half;
    for (int u = 0; u <= 2 * patch.half; ++u)
      sum += static_cast<uint32_t>(std::abs(std::clamp(patch.values[v][u] + brighter, 0, 255) - there[u]));
  }
  return sum;
}

BlockMatch block_search(const Patch& patch, const Level& level, int x, int y, int radius_x, int radius_y) {
  const SearchWindow window = inside(level.image, patch.half, x, y, radius_x, radius_y);
  if (window.left > window.right || window.top > window.bottom) return {};
  return search_blocks(patch, level, window);
}

BlockMatch block_search_among(const Patch& patch, const Level& level, int x, int y, int radius_x, int radius_y,
                              const uint8_t* candidates) {
  const SearchWindow window = inside(level.image, patch.half, x, y, radius_x, radius_y);
  BlockMatch best;
  for (int v = window.top; v <= window.bottom; ++v)
    for (int u = window.left; u <= window.right; ++u) {
      if (!candidates[static_cast<ptrdiff_t>(v) * level.image.width() + u]) continue;
      const uint32_t cost = sad(patch, level, u, v);
      if (cost < best.cost) best = {u, v, cost};
    }
  return best;
}

BlockMatch block_search_reference(const Level& previous, int from_x, int from_y, int half, const Level& level, int x,
                                  int y, int radius_x, int radius_y) {
  BlockMatch best;
  for (int l = y - radius_y; l <= y + radius_y; ++l)
    for (int k = x - radius_x; k <= x + radius_x; ++k) {
      if (k < half || l < half || k >= level.image.width() - half || l >= level.image.height() - half) continue;
      const int brighter = level.mean.row(l)[k] - previous.mean.row(from_y)[from_x];
      uint32_t cost = 0;
      for (int v = -half; v <= half; ++v)
        for (int u = -half; u <= half; ++u) {
          const int own = std::clamp(previous.image.row(from_y + v)[from_x + u] + brighter, 0, 255);
          cost += static_cast<uint32_t>(std::abs(own - level.image.row(l + v)[k + u]));
        }
      if (cost < best.cost) best = {k, l, cost};
    }
  return best;
}

}  // namespace takt::ego_motion
