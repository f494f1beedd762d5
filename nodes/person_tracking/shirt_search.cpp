// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/shirt_search.hpp"

#include <algorithm>
#include <cmath>

namespace takt::person_tracking {
namespace {

bool overlap(const Region& a, const Region& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

}  // namespace

Region region_around(const ExpectedBoard& e) {
  constexpr double kHalf = 1.5 / 2;
  return {static_cast<int>(std::floor(e.x_px - kHalf * e.width_px)),
          static_cast<int>(std::floor(e.y_px - kHalf * e.height_px)),
          static_cast<int>(std::ceil(2 * kHalf * e.width_px)), static_cast<int>(std::ceil(2 * kHalf * e.height_px))};
}

void ShirtSearch::add(std::span<const Board> found) {
  for (const Board& board : found) {
    const auto same =
        std::find_if(boards_.begin(), boards_.end(), [&](const Board& other) { return overlap(board.box, other.box); });
    if (same == boards_.end()) boards_.push_back(board);
    else if (board.corners > same->corners) *same = board;
  }
}

std::span<const Board> ShirtSearch::end(float searched) {
  searched_ = searched;
  std::sort(boards_.begin(), boards_.end(), [](const Board& a, const Board& b) {
    return a.corners != b.corners ? a.corners > b.corners : a.box.x < b.box.x;
  });
  return boards_;
}

}  // namespace takt::person_tracking
