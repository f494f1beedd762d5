// SPDX-License-Identifier: Apache-2.0
// Chessboard patterns in an image, of any size and only in part visible, as on a T-shirt: saddle points whose
// neighbours have the opposite polarity and lie along their edges. cv::findChessboardCorners wants the whole board,
// flat, its size known, and allocates.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/person_tracking/saddle_kernel.hpp"

namespace takt::person_tracking {

/// Pixels of an image: x .. x + width - 1.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
};

/// A corner between four squares, px of the image.
struct Corner {
  float x = 0, y = 0;
  float polarity_x = 0, polarity_y = 0;  ///< unit vector at twice the angle of the bright squares, clockwise from above
  int response = 0;
};

struct PixelPlace {
  float x = 0, y = 0;
};

/// Corners that belong together. `links`: pairs of neighbours among them.
struct Board {
  static constexpr size_t kMostPlaces = 64;
  Region box;  ///< of the corners and one square around them
  int corners = 0, links = 0;
  double square_px = 0;  ///< median distance of neighbours above one another (or of all, if none are)
  std::array<PixelPlace, kMostPlaces> places;  ///< of the first kMostPlaces corners
};

struct FinderParameters {
  int response_min = 60;           ///< of a corner: about four grey levels between bright and dark
  double square_max_px = 13;       ///< longest edge of a square at the level that is searched
  double polarity_max = -0.5;      ///< of neighbours: cosine between their polarities
  double beside_max = 0.4;         ///< tangent of the angle between a neighbour and the edge that it lies along
  int corners_min = 8;             ///< of a board
  double links_per_corner = 1.15;  ///< least; 3 x 3 corners have 12 links: 1.33, 2 x 4 have 10: 1.25
};

class ChessboardFinder {
 public:
  /// Levels halve the image: 0 is the image itself.
  static constexpr int kLevels = 3;
  static constexpr size_t kMostCorners = 400, kMostBoards = 8;

  /// Takes the memory for images of that size with 1 (grey) or 3 (BGR) channels; find() allocates nothing.
  ChessboardFinder(int width, int height, int channels, const FinderParameters& parameters);

  /// The boards in a region (cut to the image), at most kMostBoards, the one with most corners first, whose squares are
  /// 4 .. square_max_px pixels of the level wide. Of more than kMostCorners corners the strongest are looked at.
  std::span<const Board> find(ImageView<const uint8_t> image, const Region& region, int level);

  /// The level at which squares of that size in the image are best seen.
  static int level_for(double square_px);
  /// The corners of the last search, row by row.
  std::span<const Corner> corners() const { return corners_; }
  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }

 private:
  struct Peak {
    int x, y, response;
  };
  static constexpr int16_t kNone = -1;

  void shrink(ImageView<const uint8_t> image, const Region& region, int level);
  void find_peaks();
  bool is_peak(int x, int y) const;
  Corner refined(const Peak& peak, const Region& region, int level) const;
  void link(double reach_px);
  int side_of(size_t from, size_t to) const;
  size_t root_of(size_t corner);
  void gather(double margin_px);

  int width_, height_, channels_;
  FinderParameters p_;
  std::vector<uint8_t> grey_, line_;  ///< the region at its level; one row of the image
  std::vector<uint16_t> sums_;
  std::vector<int16_t> response_;
  ImageView<uint8_t> level_;
  std::vector<Peak> peaks_;
  std::vector<Corner> corners_;
  std::vector<int16_t> neighbour_;  ///< 4 each: the nearest on each side
  std::vector<int16_t> parent_;     ///< of a union-find forest
  std::vector<float> lengths_;
  std::vector<Board> boards_;
};

}  // namespace takt::person_tracking
