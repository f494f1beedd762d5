// SPDX-License-Identifier: Apache-2.0
#include "nodes/navigation/path_planner.hpp"

#include <algorithm>
#include <utility>

namespace takt::navigation {
namespace {

constexpr int32_t kFar = std::numeric_limits<int32_t>::max();

/// Of the way over an empty grid.
int64_t octile(double columns, double rows) {
  const double high = std::max(std::abs(columns), std::abs(rows)), low = std::min(std::abs(columns), std::abs(rows));
  return static_cast<int64_t>(high * PathPlanner::kStraight + low * (PathPlanner::kDiagonal - PathPlanner::kStraight));
}
constexpr double kRounding = 1e-9;           // a clearance of whole cells
constexpr double kCorner = 1e-9;             // share of a piece: so near to a corner it touches all four cells
constexpr double kOctilePerLength = 1.0824;  // at most: 1 / cos(22.5 deg)

/// From a cell that is so many columns and rows away, as PathPlanner::apart_ has it.
int32_t apart(int32_t columns, int32_t rows) {
  if (columns == 0 && rows == 0) return 0;
  const int32_t right = std::max(columns - 1, 0), up = std::max(rows - 1, 0);
  return 1 + right * right + up * up;
}

}  // namespace

std::string_view to_string(PathOutcome outcome) {
  switch (outcome) {
    case PathOutcome::found: return "found";
    case PathOutcome::start_outside: return "the start lies outside of the grid";
    case PathOutcome::goal_outside: return "the goal lies outside of the grid";
    case PathOutcome::goal_blocked: return "the robot has no room at the goal";
    case PathOutcome::no_way: break;
  }
  return "no way leads there";
}

PathPlanner::PathPlanner(size_t most_cells, const PathParameters& parameters)
    : parameters_(parameters),
      apart_(most_cells),
      rows_(most_cells),
      unknown_(most_cells),
      reached_(most_cells),
      open_(most_cells) {
  cells_.reserve(most_cells);
}

bool PathPlanner::look(const OccupancyView& grid) {
  const size_t cells = static_cast<size_t>(grid.cells.width) * static_cast<size_t>(grid.cells.height);
  if (cells > apart_.size()) return false;
  grid_ = grid;
  looked_m_ = parameters_.clearance_m;
  const double clearance = looked_m_ / grid.cell_m;
  blocked_ = static_cast<int32_t>(std::ceil(clearance * clearance - kRounding));
  for (int row = 0; row < grid.cells.height; ++row)
    for (int column = 0; column < grid.cells.width; ++column)
      unknown_[index({column, row})] = grid.cells.at(column, row) == kUnknownCell;
  grow_obstacles();
  grid_.cells.data = nullptr;  // the caller's memory may be gone at the next call
  return true;
}

void PathPlanner::remember(StateArchive& archive) {
  OccupancyView grid = grid_;
  double looked_m = looked_m_;
  TAKT_STATE(archive, grid.cells.width, grid.cells.height, grid.cell_m, grid.origin_x_m, grid.origin_y_m, cost_,
             expanded_, looked_m);
  archive.room(apart_.size() / 4 + 1);
  const auto width = static_cast<size_t>(std::max(0, grid.cells.width)),
             height = static_cast<size_t>(std::max(0, grid.cells.height));
  if (width > apart_.size() || height > apart_.size() || width * height > apart_.size()) return archive.fail();
  std::vector<int16_t> cells(archive.loads() ? width * height : 0);
  for (size_t i = 0; i < width * height && !archive.failed(); i += 4) {
    uint8_t four = 0;
    const size_t end = std::min(i + 4, width * height);
    for (size_t at = i; at < end && !archive.loads(); ++at)
      four = static_cast<uint8_t>(four | (apart_[at] == 0 ? 1 : unknown_[at] != 0 ? 2 : 0) << 2 * (at - i));
    archive(four);
    for (size_t at = i; at < end && archive.loads(); ++at) {
      const int what = four >> 2 * (at - i) & 3;
      cells[at] = what == 1 ? int16_t{1000} : what == 2 ? kUnknownCell : int16_t{0};
    }
  }
  if (!archive.loads() || archive.failed() || cells.empty()) return;
  grid.cells.data = cells.data();
  const double now_m = std::exchange(parameters_.clearance_m, looked_m);
  look(grid);
  parameters_.clearance_m = now_m;
}

/// First along each column, then over the columns as far as the clearance reaches.
void PathPlanner::grow_obstacles() {
  const int width = grid_.cells.width, height = grid_.cells.height;
  const int reach = blocked_ == 0 ? 0 : 1 + static_cast<int>(std::sqrt(blocked_ - 1));
  for (int column = 0; column < width; ++column) {
    int last = -kFar / 2;
    for (int row = 0; row < height; ++row) {
      if (grid_.cells.at(column, row) > kHalfOccupied) last = row;
      rows_[index({column, row})] = row - last;
    }
    last = kFar / 2;
    for (int row = height - 1; row >= 0; --row) {
      int32_t& nearest = rows_[index({column, row})];
      if (nearest == 0) last = row;
      nearest = std::min(nearest, last - row);
    }
  }
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      int32_t nearest = kFar;
      for (int other = std::max(0, column - reach); other <= std::min(width - 1, column + reach); ++other) {
        const int32_t rows = rows_[index({other, row})], columns = std::abs(other - column);
        if (rows <= reach) nearest = std::min(nearest, apart(columns, rows));
      }
      apart_[index({column, row})] = nearest;
    }
}

bool PathPlanner::may_step(const Cell& from, const Cell& to) const {
  if (!grid_.contains(to)) return false;
  const int32_t there = apart_[index(to)];
  if (there <= blocked_ && (there == 0 || there <= apart_[index(from)])) return false;
  if (from.column == to.column || from.row == to.row || blocked(from)) return true;
  return !blocked({from.column, to.row}) && !blocked({to.column, from.row});
}

int64_t PathPlanner::step_cost(const Cell& from, const Cell& to) const {
  const int64_t length = from.column == to.column || from.row == to.row ? kStraight : kDiagonal;
  return unknown_[index(to)] != 0 ? length * parameters_.unknown_factor : length;
}

int64_t PathPlanner::left_at_least(const Cell& cell, const Place& to, double reach) const {
  const double column = (to.x_m - grid_.origin_x_m) / grid_.cell_m - 0.5,
               row = (to.y_m - grid_.origin_y_m) / grid_.cell_m - 0.5;
  // The goal may lie anywhere in its cell.
  const auto slack = static_cast<int64_t>(kOctilePerLength * kStraight * std::max(reach, 0.75)) + 1;
  return std::max<int64_t>(0, octile(cell.column - column, cell.row - row) - slack);
}

template <class There, class Left>
std::optional<uint32_t> PathPlanner::search(const Cell& from, There there, Left left) {
  ++searches_;
  open_.clear();
  expanded_ = 0;
  reached_[index(from)] = {0, index(from), searches_};
  open_.put(index(from), {left(from), 0});
  while (!open_.empty()) {
    const uint32_t here = open_.take_least();
    const Cell at = cell(here);
    ++expanded_;
    if (there(at)) {
      cost_ = reached_[here].cost;
      return here;
    }
    for (int row = -1; row <= 1; ++row)
      for (int column = -1; column <= 1; ++column) {
        const Cell next{at.column + column, at.row + row};
        if (next == at || !may_step(at, next)) continue;
        const int64_t cost = reached_[here].cost + step_cost(at, next);
        Reached& reached = reached_[index(next)];
        if (reached.search == searches_ && reached.cost <= cost) continue;
        reached = {cost, here, searches_};
        open_.put(index(next), {cost + left(next), -cost});
      }
  }
  return std::nullopt;
}

PathOutcome PathPlanner::plan(const Place& from, const Place& to, double reach_m, std::vector<Place>& path) {
  if (reach_m > 0) return plan_near(from, {&to, 1}, reach_m, path);
  path.clear();
  const Cell start = grid_.cell_of(from.x_m, from.y_m), goal = grid_.cell_of(to.x_m, to.y_m);
  if (!grid_.contains(start)) return PathOutcome::start_outside;
  if (!grid_.contains(goal)) return PathOutcome::goal_outside;
  if (blocked(goal) && goal != start) return PathOutcome::goal_blocked;
  const auto end = search(
      start, [&](const Cell& c) { return c == goal; }, [&](const Cell& c) { return left_at_least(c, to, 0); });
  if (!end) return PathOutcome::no_way;
  write_way(from, *end, to, path);
  return PathOutcome::found;
}

PathOutcome PathPlanner::plan_near(const Place& from, std::span<const Place> places, double reach_m,
                                   std::vector<Place>& path) {
  path.clear();
  const Cell start = grid_.cell_of(from.x_m, from.y_m);
  if (!grid_.contains(start)) return PathOutcome::start_outside;
  for (const Place& place : places)
    if (!grid_.contains(grid_.cell_of(place.x_m, place.y_m))) return PathOutcome::goal_outside;
  const auto there = [&](const Cell& c) {
    const Disc reach{middle(c), reach_m};
    return !blocked(c) && std::all_of(places.begin(), places.end(), [&](const Place& p) { return reach.contains(p); });
  };
  const auto left = [&](const Cell& c) {
    int64_t most = 0;
    for (const Place& place : places) most = std::max(most, left_at_least(c, place, reach_m / grid_.cell_m));
    return most;
  };
  const auto end = search(start, there, left);
  if (!end) return PathOutcome::no_way;
  write_way(from, *end, middle(cell(*end)), path);
  return PathOutcome::found;
}

PathOutcome PathPlanner::plan_to_unknown(const Place& from, const Disc& area, std::span<const Disc> seen,
                                         std::vector<Place>& path) {
  path.clear();
  const Cell start = grid_.cell_of(from.x_m, from.y_m);
  if (!grid_.contains(start)) return PathOutcome::start_outside;
  const auto unknown = [&](int column, int row) {
    return grid_.contains({column, row}) && unknown_[index({column, row})] != 0;
  };
  const auto there = [&](const Cell& c) {
    if (blocked(c) || unknown(c.column, c.row)) return false;
    if (!unknown(c.column + 1, c.row) && !unknown(c.column - 1, c.row) && !unknown(c.column, c.row + 1) &&
        !unknown(c.column, c.row - 1))
      return false;
    const Place place = middle(c);
    return area.contains(place) &&
           std::none_of(seen.begin(), seen.end(), [&](const Disc& disc) { return disc.contains(place); });
  };
  const auto end = search(start, there, [](const Cell&) { return int64_t{0}; });
  if (!end) return PathOutcome::no_way;
  write_way(from, *end, middle(cell(*end)), path);
  return PathOutcome::found;
}

void PathPlanner::write_way(const Place& from, uint32_t end, const Place& to, std::vector<Place>& path) {
  const uint32_t start = index(grid_.cell_of(from.x_m, from.y_m));
  cells_.clear();
  for (uint32_t at = end; at != start; at = reached_[at].from) cells_.push_back(at);
  path.push_back(from);
  Place last = from;
  for (size_t i = cells_.size(); i-- > 0;) {
    const Place next = i == 0 ? to : middle(cell(cells_[i]));
    // Straight on from the newest corner as far as the way is free; else the cell before is a corner.
    if (path.back().x_m != last.x_m || path.back().y_m != last.y_m)
      if (!sees(path.back(), next)) path.push_back(last);
    last = next;
  }
  path.push_back(to);
}

template <class Visit>
bool PathPlanner::along(const Place& a, const Place& b, Visit visit) const {
  Cell at = grid_.cell_of(a.x_m, a.y_m);
  const Cell end = grid_.cell_of(b.x_m, b.y_m);
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  const int right = dx > 0 ? 1 : -1, up = dy > 0 ? 1 : -1;
  // Share of the piece at which it enters the next column and the next row.
  const auto crossing = [&](double origin_m, double from_m, double d, int cell, int step) {
    return d == 0 ? std::numeric_limits<double>::infinity()
                  : (origin_m + (cell + (step > 0 ? 1 : 0)) * grid_.cell_m - from_m) / d;
  };
  while (visit(at)) {
    if (at == end) return true;
    const double column = crossing(grid_.origin_x_m, a.x_m, dx, at.column, right),
                 row = crossing(grid_.origin_y_m, a.y_m, dy, at.row, up);
    const bool columns_left = at.column != end.column, rows_left = at.row != end.row;
    if (columns_left && rows_left && std::abs(column - row) < kCorner) {
      if (!visit({at.column + right, at.row}) || !visit({at.column, at.row + up})) return false;
      at = {at.column + right, at.row + up};
    } else if (columns_left && (column < row || !rows_left)) {
      at.column += right;
    } else {
      at.row += up;
    }
  }
  return false;
}

/// Straight through known and free cells, so that cutting the corners of a way never costs more.
bool PathPlanner::sees(const Place& a, const Place& b) const {
  return along(a, b, [&](const Cell& c) { return grid_.contains(c) && !blocked(c) && unknown_[index(c)] == 0; });
}

bool PathPlanner::free(std::span<const Place> path) const {
  for (size_t i = 0; i + 1 < path.size(); ++i)
    if (!along(path[i], path[i + 1], [&](const Cell& c) { return grid_.contains(c) && !blocked(c); })) return false;
  return true;
}

}  // namespace takt::navigation
