// SPDX-License-Identifier: Apache-2.0
#include "nodes/mission/way_ahead.hpp"

#include <algorithm>

namespace takt::mission {

using navigation::PathOutcome;
using navigation::Place;

WayAhead::WayAhead(size_t most_cells, const WayAheadParameters& parameters)
    : parameters_(parameters), planner_(most_cells, parameters.path) {
  constexpr double kNearest_m = 1, kAlong_m = 0.5, kAside_m = 0.4;
  for (double along = kNearest_m; along <= parameters.farthest_m; along += kAlong_m)
    for (double aside = 0; aside <= std::min(along, parameters.aside_m); aside += kAside_m)
      for (const double side : {1.0, -1.0})
        if (aside > 0 || side > 0) candidates_.push_back({along, side * aside});
  const auto worth = [&](const Place& p) { return p.x_m - parameters.aside_weight * std::abs(p.y_m); };
  std::stable_sort(candidates_.begin(), candidates_.end(),
                   [&](const Place& a, const Place& b) { return worth(a) > worth(b); });
  way_.reserve(std::max<size_t>(2, most_cells));
}

std::optional<Place> WayAhead::next(const navigation::OccupancyView& grid, const Place& from, double direction_rad) {
  if (!planner_.look(grid)) return std::nullopt;
  const double c = std::cos(direction_rad), s = std::sin(direction_rad);
  for (const Place& p : candidates_) {
    const Place to{from.x_m + c * p.x_m - s * p.y_m, from.y_m + s * p.x_m + c * p.y_m};
    const navigation::Cell cell = grid.cell_of(to.x_m, to.y_m);
    if (!grid.contains(cell) || grid.cells.at(cell.column, cell.row) == navigation::kUnknownCell) continue;
    if (planner_.plan(from, to, 0, way_) != PathOutcome::found) continue;
    if (planner_.cost_m() <= parameters_.longest_way * std::hypot(p.x_m, p.y_m)) return to;
  }
  return std::nullopt;
}

}  // namespace takt::mission
