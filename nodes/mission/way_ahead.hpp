// SPDX-License-Identifier: Apache-2.0
// Where to drive next on free ground, if all that is known of the goal is a direction.
#pragma once
#include <optional>
#include <vector>

#include "nodes/navigation/path_planner.hpp"

namespace takt::mission {

struct WayAheadParameters {
  /// Wider than the way that is then driven needs: whoever may choose keeps off kerbs and walls.
  navigation::PathParameters path{0.75, 2};
  double farthest_m = 3.5, aside_m = 2.0;  ///< along the direction, and beside it
  double aside_weight = 0.6;               ///< what a metre beside it costs, in metres along it
  double longest_way = 2.0;                ///< as a multiple of the straight line
};

/// Memory is taken by the constructor. One thread at a time.
class WayAhead {
 public:
  /// For grids of at most so many cells.
  WayAhead(size_t most_cells, const WayAheadParameters& parameters);
  /// From the next call of next() on.
  void tune(const WayAheadParameters& parameters) {
    parameters_ = parameters;
    planner_.tune(parameters.path);
  }

  /// The known and free place that lies farthest along the direction (from the map's x axis), least beside it and at
  /// most 45 degrees off, to which a way leads over the grid. None: there is no such place, or the grid is larger than
  /// the constructor was told.
  std::optional<navigation::Place> next(const navigation::OccupancyView& grid, const navigation::Place& from,
                                        double direction_rad);

 private:
  WayAheadParameters parameters_;
  navigation::PathPlanner planner_;
  std::vector<navigation::Place> candidates_;  ///< x along the direction, y to its left; the best first
  std::vector<navigation::Place> way_;
};

}  // namespace takt::mission
