// SPDX-License-Identifier: Apache-2.0
// Small islands of blocked cells amid free floor: spots that differ from the floor in colour alone.
#pragma once
#include <algorithm>
#include <vector>

#include "nodes/ground_map/ground_grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::ground_map {

/// Finds islands and frees them. Allocates in the constructor alone; one thread at a time.
class Specks {
 public:
  /// For windows of `cells` x `cells`; larger islands than `most` cells stay, with 0 all do.
  Specks(int cells, int most);
  void tune(int most) { most_ = most; }

  /// Sets to kFree what is occupied (above 500) in islands (8-connected) of at most `most` cells, of which every
  /// neighbour is known and every cell `seen_past`. A border of the floor is longer, and what stands on it is seen by a
  /// scanner.
  template <class SeenPast>  // bool(int column, int row)
  void clear(ImageView<int16_t> cells, const SeenPast& seen_past);

 private:
  /// Takes the island of that cell into island_. False if there is none, it is too large or touches what is unknown.
  bool grow(ImageView<const int16_t> cells, int first);

  int most_;
  std::vector<uint8_t> visited_;
  std::vector<int> island_;  ///< indices of cells
};

template <class SeenPast>
void Specks::clear(ImageView<int16_t> cells, const SeenPast& seen_past) {
  std::fill(visited_.begin(), visited_.end(), 0);
  for (int first = 0; most_ > 0 && first < cells.width * cells.height; ++first) {
    if (visited_[static_cast<size_t>(first)] || !grow(cells, first)) continue;
    const bool flat = std::all_of(island_.begin(), island_.end(),
                                  [&](int index) { return seen_past(index % cells.width, index / cells.width); });
    for (const int index : island_)
      if (flat) cells.at(index % cells.width, index / cells.width) = kFree;
  }
}

/// Whether all beams that cross the cell end behind it or do not return. `cell` is its middle in the robot frame of the
/// scan; one that the scanner does not look at is not seen past.
bool sees_past(const LaserScan& scan, const FloorPoint& cell, double cell_m);

}  // namespace takt::ground_map
