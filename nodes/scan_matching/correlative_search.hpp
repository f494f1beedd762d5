// SPDX-License-Identifier: Apache-2.0
// The best place for a scan within reach of where it is expected, whatever lies between (Olson 2009): all turns and all
// shifts by whole cells are candidates; blocks of shifts whose bound is below the best are never looked at.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/scan_matching/score_field.hpp"

namespace takt::scan_matching {

struct SearchParameters {
  double reach_m = 0.4, reach_rad = 0.35;  ///< to each side of what is expected
  double step_rad = 0.00873;               ///< between two turns
  /// What a candidate loses at one standard deviation from what is expected, as a share of the score of a perfect fit;
  /// four times as much at two. Decides where the map does not, as along a corridor.
  double prior = 0.02;
};

/// Where a scan is expected, and the standard deviation of that.
struct Expected {
  PlanarPose robot_in_map;
  double sigma_m = 0.1, sigma_rad = 0.05;
};

struct Found {
  PlanarPose robot_in_map;
  int32_t score = 0;    ///< sum over the points of the field's values, less what the prior takes
  int32_t penalty = 0;  ///< that
  int32_t candidate = -1;

  bool operator==(const Found& other) const { return score == other.score && candidate == other.candidate; }
};

class CorrelativeSearch {
 public:
  /// For scans of at most `points` points. Allocates here only.
  CorrelativeSearch(size_t points, const SearchParameters& parameters, double cell_m);

  /// The candidate with the highest score; of equal ones the one with the least penalty, then the first. Points beyond
  /// the field, less the reach, count nothing.
  Found find(const ScoreField& field, std::span<const SurfacePoint> points, const Expected& expected);
  /// The same by trying every candidate.
  Found find_reference(const ScoreField& field, std::span<const SurfacePoint> points, const Expected& expected);

  int turns() const { return 2 * turns_ + 1; }
  int shifts() const { return 2 * shifts_ + 1; }

 private:
  struct Cell {
    int32_t column, row;
  };
  /// Shifts column..column + kBlock - 1, and so on, at one turn.
  struct Block {
    int32_t bound, turn, column, row;
    bool operator<(const Block& other) const { return bound < other.bound; }
  };
  void prepare(const ScoreField& field, std::span<const SurfacePoint> points, const Expected& expected);
  std::span<const Cell> cells(int turn) const;
  int32_t penalty(int turn, int column, int row) const;
  int32_t least_penalty(int first) const;
  Block bounded(const ScoreField& field, int turn, int column, int row) const;
  void expand(const ScoreField& field, const Block& block, Found& best) const;
  void offer(int32_t sum, int turn, int column, int row, Found& best) const;
  PlanarPose pose_of(const Found& found, const PlanarPose& expected) const;

  SearchParameters p_;
  double cell_m_;
  int turns_, shifts_;
  size_t most_points_;
  std::vector<Cell> cells_;     ///< turns() x most_points_, at shift 0
  std::vector<size_t> counts_;  ///< points of each turn that lie in the field
  std::vector<int32_t> turn_penalty_, shift_penalty_;
  std::vector<Block> heap_;
};

}  // namespace takt::scan_matching
