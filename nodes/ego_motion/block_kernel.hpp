// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/ego_motion/block_search.hpp"

namespace takt::ego_motion {

/// Inclusive bounds of block centres.
struct SearchWindow {
  int left = 0, right = 0, top = 0, bottom = 0;
};

/// Internal: the vectorised block_search over a window all of whose squares lie inside the image; the same result on
/// every SIMD target.
BlockMatch search_blocks(const Patch& patch, const Level& level, const SearchWindow& window);

}  // namespace takt::ego_motion
