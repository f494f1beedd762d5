// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/block_search.hpp"

namespace takt::ego_motion {

BlockMatch block_search_reference(const Plane& previous, int from_x, int from_y, int half, const Plane& image, int x,
                                  int y, int radius_x, int radius_y) {
  BlockMatch best;
  for (int l = y - radius_y; l <= y + radius_y; ++l)
    for (int k = x - radius_x; k <= x + radius_x; ++k) {
      if (k < half || l < half || k >= image.width() - half || l >= image.height() - half) continue;
      uint32_t cost = 0;
      for (int v = -half; v <= half; ++v)
        for (int u = -half; u <= half; ++u)
          cost += static_cast<uint32_t>(std::abs(previous.row(from_y + v)[from_x + u] - image.row(l + v)[k + u]));
      if (cost < best.cost) best = {k, l, cost};
    }
  return best;
}

}  // namespace takt::ego_motion
