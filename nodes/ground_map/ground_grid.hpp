// SPDX-License-Identifier: Apache-2.0
// From the mask of one image to cells, and from many images to an occupancy grid (thesis Sec. 4.2.2, 4.2.3; ).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/ground_map/confidence.hpp"
#include "nodes/ground_map/floor_projection.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::ground_map {

constexpr int16_t kFree = 0, kOccupied = 1000, kUnknown = Grid::unknown;

/// What votes for a cell.
enum class Votes : uint8_t {
  columns,  ///< image columns: free where one runs through the cell on ground, blocked where its ground ends in the
            ///< cell
  pixels,   ///< ground pixels for free, first pixels that are not for blocked (R-7.5)
};

struct GridParameters {
  double cell_m = 0.30;
  double window_m = 18;    ///< side of the square around the robot, rounded up to whole cells on both sides
  double range_max_m = 8;  ///< farther floor is not looked at
  Votes votes = Votes::columns;
  int votes_min = 5;         ///< a cell with fewer votes is not seen
  int up = 200, down = 100;  ///< added where surely blocked, taken off where free; of 1000
  int beyond_px = 4;  ///< so far above the first pixel that is not ground its confidence is read, out of the blur
};

/// A square of cells of the map frame, aligned with its axes; cell (0, 0) is cell (column, row) of the plane.
struct Window {
  int64_t column = 0, row = 0;
  int cells = 0;
  double cell_m = 0;
  FloorPoint origin() const { return {static_cast<double>(column) * cell_m, static_cast<double>(row) * cell_m}; }
};

/// Cells of the map frame in a square that follows the robot. Allocates in the constructor only; one thread at a time.
class GroundGrid {
 public:
  GroundGrid(int image_width, const GridParameters& parameters);
  /// From now on; cells and window stay as they were.
  void tune(GridParameters parameters) {
    parameters.cell_m = p_.cell_m;
    parameters.window_m = p_.window_m;
    p_ = parameters;
  }

  /// Moves the window by whole cells so that (x, y) lies in its middle cell; what comes in is unknown.
  void centre(const FloorPoint& robot_in_map);
  /// Cells of one image alone: kFree, kOccupied or kUnknown, kept until the next call. Per column of the image only the
  /// ground up to the first pixel that is none counts, and that pixel as an obstacle; nothing beyond.
  /// `robot` is the position that range_max is counted from, `projection` leads to the map frame.
  void observe(ImageView<const uint8_t> mask, const FloorProjection& projection, const FloorPoint& robot,
               const Confidence& confidence = {});
  /// An observation in which every cell is unknown.
  void see_nothing();
  /// Adds the observation to the map: unknown starts at 500, blocked + up times the mean confidence of its votes, free
  /// - down, within 0..1000.
  void accumulate();

  /// Takes up the map that an earlier process gave: cells row by row, of the window whose first cell lies at `origin`
  /// of the map frame. False if it is of another size.
  bool resume(std::span<const int16_t> cells, const FloorPoint& origin);

  const Window& window() const { return window_; }
  ImageView<const int16_t> observation() const { return {observation_.data(), window_.cells, window_.cells}; }
  ImageView<const int16_t> map() const { return {map_.data(), window_.cells, window_.cells}; }
  ImageView<int16_t> map() { return {map_.data(), window_.cells, window_.cells}; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, window_.column, window_.row, map_); }

 private:
  struct Tally {
    int32_t free = 0, blocked = 0;
    int32_t confidence = 0;  ///< sum over those that are blocked, each of kSure
  };
  static constexpr int32_t kEnded = -2;
  static constexpr int kBlock = 16;
  bool idle(const uint8_t* mask, int first) const;
  void count_row(const uint8_t* mask, int width, int y, const Confidence& confidence);
  void count(bool ground, int x, int y, const Confidence& confidence);
  void close(int32_t& cell);

  GridParameters p_;
  Window window_;
  std::vector<int16_t> map_, observation_;
  std::vector<int16_t> change_;  ///< by the observation, of 1000
  std::vector<Tally> tallies_;
  std::vector<int32_t> row_cells_;  ///< per pixel of a row: its cell or kNoCell
  std::vector<int32_t> column_;     ///< per column of the image: cell of the last pixel, kNoCell, or kEnded
  int open_ = 0;                    ///< columns that have not ended
};

}  // namespace takt::ground_map
