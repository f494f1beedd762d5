// SPDX-License-Identifier: Apache-2.0
// The cheapest way over an occupancy grid (R-15.3; the thesis names the block and prints no
// algorithm): A* over 8 neighbours, obstacles grown by the robot's radius.
#pragma once
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "nodes/navigation/indexed_heap.hpp"
#include "nodes/navigation/occupancy_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::navigation {

struct Place {
  double x_m = 0, y_m = 0;
};

struct Disc {
  Place middle;
  double radius_m = 0;
  bool contains(const Place& place) const {
    return std::hypot(place.x_m - middle.x_m, place.y_m - middle.y_m) <= radius_m;
  }
};

struct PathParameters {
  double clearance_m = 0.58;  ///< nearer to any place of an occupied cell the robot's centre does not go
  int unknown_factor = 3;     ///< what an unknown cell costs, in known ones
};

enum class PathOutcome : uint8_t { found, start_outside, goal_outside, goal_blocked, no_way };
std::string_view to_string(PathOutcome outcome);

/// A cell is blocked if it is occupied, or if some place in it is nearer than the clearance to some place in an
/// occupied one: wherever in its cells the robot drives, it has the clearance. Steps cost 1000 or, diagonally, 1414
/// (times unknown_factor into an unknown cell), so that sums are exact; no step cuts the corner of a blocked cell. A
/// robot that stands too near to an obstacle may move away from it, cell by cell. Memory is taken by the constructor.
/// One thread at a time.
class PathPlanner {
 public:
  /// For grids of at most so many cells.
  PathPlanner(size_t most_cells, const PathParameters& parameters);
  /// From the next look() on.
  void tune(const PathParameters& parameters) { parameters_ = parameters; }

  /// Looks at the grid anew; the ways before hold no longer. False: the grid is larger than the constructor was told.
  bool look(const OccupancyView& grid);

  /// A way to within `reach_m` of `to` (0: to the place itself), in place of what `path` held: its corners, `from`
  /// first. What `path` can hold without allocating is the caller's to reserve: at most one place a cell.
  PathOutcome plan(const Place& from, const Place& to, double reach_m, std::vector<Place>& path);
  /// The same to within `reach_m` > 0 of each of `places`, to the middle of a cell.
  PathOutcome plan_near(const Place& from, std::span<const Place> places, double reach_m, std::vector<Place>& path);
  /// The same to the nearest known cell beside an unknown one that lies in `area` and in none of `seen`.
  PathOutcome plan_to_unknown(const Place& from, const Disc& area, std::span<const Disc> seen,
                              std::vector<Place>& path);

  /// Whether no blocked cell lies on the straight pieces of a way: while it is true nothing has to be planned again.
  bool free(std::span<const Place> path) const;

  /// Of the newest way, m of known cells.
  double cost_m() const { return static_cast<double>(cost_) / kStraight * grid_.cell_m; }
  size_t expanded() const { return expanded_; }
  /// The grid, two bits a cell.
  void remember(StateArchive& archive);

  /// For tests: cost of the newest search as a sum of steps; whether the robot may not be there.
  int64_t cost() const { return cost_; }
  bool blocked(const Cell& cell) const { return apart_[index(cell)] <= blocked_; }

  static constexpr int64_t kStraight = 1000, kDiagonal = 1414;

 private:
  struct Reached {
    int64_t cost;
    uint32_t from;
    uint32_t search;  ///< number of the search that wrote this
  };
  using Key = std::pair<int64_t, int64_t>;  ///< cost with what is left at least; then the farther first

  uint32_t index(const Cell& cell) const {
    return static_cast<uint32_t>(cell.row) * static_cast<uint32_t>(grid_.cells.width) +
           static_cast<uint32_t>(cell.column);
  }
  Cell cell(uint32_t index) const {
    const auto width = static_cast<uint32_t>(grid_.cells.width);
    return {static_cast<int>(index % width), static_cast<int>(index / width)};
  }
  Place middle(const Cell& cell) const { return {grid_.middle_x_m(cell), grid_.middle_y_m(cell)}; }
  void grow_obstacles();
  bool may_step(const Cell& from, const Cell& to) const;
  int64_t step_cost(const Cell& from, const Cell& to) const;
  /// Steps that a place at most `reach` cells from this one is away at least.
  int64_t left_at_least(const Cell& cell, const Place& to, double reach) const;
  /// Number of the first cell where there(cell); left(cell) is what is left to such a one at least.
  template <class There, class Left>
  std::optional<uint32_t> search(const Cell& from, There there, Left left);
  /// The corners of the way to the cell that was reached, in which `to` lies.
  void write_way(const Place& from, uint32_t end, const Place& to, std::vector<Place>& path);
  /// visit(cell) for each cell that a straight piece passes; ends early where that returns false, and tells so.
  template <class Visit>
  bool along(const Place& a, const Place& b, Visit visit) const;
  bool sees(const Place& a, const Place& b) const;

  PathParameters parameters_;
  OccupancyView grid_;
  double looked_m_ = 0;  ///< clearance of the newest look
  int32_t blocked_ = 0;  ///< cells that are no farther apart from an occupied one are
  /// From the nearest occupied cell, as far as blocked_: 0 it is that, else 1 + the square of the cells between them.
  std::vector<int32_t> apart_;
  std::vector<int32_t> rows_;  ///< to the nearest occupied cell of the column
  std::vector<uint8_t> unknown_;
  std::vector<Reached> reached_;
  std::vector<uint32_t> cells_;  ///< of a way, backwards
  IndexedHeap<Key> open_;
  uint32_t searches_ = 0;
  int64_t cost_ = 0;
  size_t expanded_ = 0;
};

}  // namespace takt::navigation
