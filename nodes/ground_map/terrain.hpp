// SPDX-License-Identifier: Apache-2.0
// What the floor around the robot is like, from the occupancy grid: the cells around it, heading up, are compared with
// a learnt map of each kind, and counters decide.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "nodes/ground_map/ground_grid.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/state_archive.hpp"

namespace takt::ground_map {

/// Kinds of terrain that have a map: left, right, middle, crossing. The fifth hypothesis is "unknown".
constexpr size_t kTerrainKinds = terrain_kind::unknown, kHypotheses = kTerrainKinds + 1;
constexpr std::array<std::string_view, kHypotheses> kTerrainNames{"left", "right", "middle", "crossing", "unknown"};

/// Cells around the robot: column 0 on the left, row 0 behind it. The robot stands at the lower left corner of cell
/// (left, behind).
struct TerrainShape {
  int columns = 24, rows = 24;
  int left = 12, behind = 6;
  double cell_m = 0.30;
  size_t cells() const { return static_cast<size_t>(columns) * static_cast<size_t>(rows); }
  bool operator==(const TerrainShape&) const = default;
};

/// The cells of `map` at the centres of those around the robot, row by row; kUnknown outside of the window. `out` has
/// shape.cells() elements.
void cells_around(ImageView<const int16_t> map, const Window& window, const PlanarPose& robot_in_map,
                  const TerrainShape& shape, std::span<int16_t> out);

/// Cells of each kind, 0 free .. 1000 occupied, kUnknown; all of shape.cells().
struct TerrainMaps {
  TerrainShape shape;
  std::array<std::vector<int16_t>, kTerrainKinds> cells;
};

/// From many measured maps of a kind its map: the mean of each cell over the maps in which it is known.
class TerrainLearning {
 public:
  explicit TerrainLearning(const TerrainShape& shape);
  void add(size_t kind, std::span<const int16_t> cells);
  int maps(size_t kind) const { return maps_[kind]; }
  TerrainMaps learnt() const;

 private:
  struct Sum {
    int64_t value = 0, count = 0;
  };
  TerrainShape shape_;
  std::array<int, kTerrainKinds> maps_{};
  std::array<std::vector<Sum>, kTerrainKinds> sums_;
};

/// From where cells are counted when two maps are correlated.
enum class Centre : uint8_t {
  undecided,  ///< 500: free and occupied are opposite signs, and a map that is free all over has a correlation, too.
              ///< Counted are the cells that are known around the robot; those that no map of the kind has shown count
              ///< as undecided, so that where nothing is known of a kind tells it apart
  mean,       ///< of each map over the cells known in both (Pearson): a map that is free all over has none
};

struct TerrainParameters {
  Centre centre = Centre::undecided;
  double known_min = 0.3;        ///< share of the cells that must be known in both maps
  double correlation_min = 0.7;  ///< above it the best kind is believed; with `mean` the reference recommends 0.5
  double crossing_min = 0.9;  ///< the same for a crossing, which is free all over and so resembles all that mostly is
  int up = 200, down = 100;   ///< of 1000
};

/// -1..1, of the cells around the robot and the map of a kind. None if too few cells are known in both, or one has no
/// contrast.
std::optional<double> correlation(std::span<const int16_t> around, std::span<const int16_t> kind, Centre centre,
                                  double known_min);

/// Counters of the five hypotheses. Allocates in the constructor only.
class TerrainClassifier {
 public:
  TerrainClassifier(TerrainMaps maps, const TerrainParameters& parameters);
  void tune(const TerrainParameters& parameters) { p_ = parameters; }
  const TerrainShape& shape() const { return maps_.shape; }
  /// Takes the cells around the robot: the counter of the kind with the highest correlation rises if that is high
  /// enough, else that of "unknown"; all others fall. The answer is the highest counter; of equal ones the present
  /// answer, then the first.
  const Terrain& step(std::span<const int16_t> cells);
  const Terrain& answer() const { return answer_; }
  /// What the newest cells alone say.
  size_t believed() const { return believed_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, counters_, believed_, answer_); }

 private:
  TerrainMaps maps_;
  TerrainParameters p_;
  std::array<int, kHypotheses> counters_{};  ///< 0..1000
  size_t believed_ = terrain_kind::unknown;
  Terrain answer_;
};

}  // namespace takt::ground_map
