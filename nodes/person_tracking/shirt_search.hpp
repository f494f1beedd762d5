// SPDX-License-Identifier: Apache-2.0
// Where to look for the shirt: first where it is expected, then in the whole image, as long as there is time.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "nodes/person_tracking/chessboard_finder.hpp"

namespace takt::person_tracking {

/// How the shirt should look in an image, px.
struct ExpectedBoard {
  double x_px = 0, y_px = 0;  ///< its middle
  double width_px = 0, height_px = 0, square_px = 0;
};

/// The expected box, enlarged by half.
Region region_around(const ExpectedBoard& expected);

class ShirtSearch {
 public:
  ShirtSearch(int width, int height, int channels, const FinderParameters& parameters)
      : finder_(width, height, channels, parameters) {
    boards_.reserve(ChessboardFinder::kLevels * ChessboardFinder::kMostBoards);
  }

  /// The boards in the region where one is expected; if there are none, or none is expected, those in the whole image
  /// at any level, of those that overlap the one with most corners. Asks may_go_on() before each search but the first.
  template <class MayGoOn>
  std::span<const Board> run(ImageView<const uint8_t> image, const std::optional<ExpectedBoard>& expected,
                             const MayGoOn& may_go_on) {
    boards_.clear();
    searched_ = 0;
    if (expected) {
      add(finder_.find(image, region_around(*expected), ChessboardFinder::level_for(expected->square_px)));
      if (!boards_.empty()) return end(1);
    }
    int done = 0;
    for (const int level : kOrder) {
      if ((expected || done > 0) && !may_go_on()) break;
      add(finder_.find(image, {0, 0, image.width, image.height}, level));
      ++done;
    }
    return end(static_cast<float>(done) / ChessboardFinder::kLevels);
  }

  /// Share of what was to be searched, 0 .. 1: less if the time ran out.
  float searched() const { return searched_; }
  const ChessboardFinder& finder() const { return finder_; }

 private:
  static constexpr std::array<int, ChessboardFinder::kLevels> kOrder{1, 0,
                                                                     2};  // whom one follows is neither near nor far
  void add(std::span<const Board> found);
  std::span<const Board> end(float searched);

  ChessboardFinder finder_;
  std::vector<Board> boards_;
  float searched_ = 1;
};

}  // namespace takt::person_tracking
