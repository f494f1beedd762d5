// SPDX-License-Identifier: Apache-2.0
// From an image to the person in the shirt: search, place, track.
#pragma once
#include <array>

#include "nodes/person_tracking/person_tracker.hpp"
#include "nodes/person_tracking/shirt_search.hpp"
#include "rt/state_archive.hpp"

namespace takt::person_tracking {

struct PersonTrackingParameters {
  FinderParameters finder;
  ShirtParameters shirt;
  TrackerParameters tracker;
};

/// One image and what is known about it.
struct Frame {
  int64_t stamp_ns = 0;
  ImageView<const uint8_t> image;  ///< left, rectified
  Disparities disparities;
  Viewpoint view;
};

class PersonTracking {
 public:
  /// For images of that size with 1 or 3 channels. Takes its memory here; look() allocates nothing.
  PersonTracking(int width, int height, int channels, const PersonTrackingParameters& parameters)
      : p_(parameters), search_(width, height, channels, parameters.finder), tracker_(parameters.tracker) {}

  /// From the next image on, but for the finder's.
  void tune(PersonTrackingParameters parameters) {
    parameters.finder = p_.finder;
    p_ = parameters;
    tracker_.tune(parameters.tracker);
  }

  /// Asks may_go_on() before each search of the image but the first; when that says no, with what was found so far.
  template <class MayGoOn>
  void look(const Frame& frame, std::span<const Place> bodies, const MayGoOn& may_go_on) {
    boards_ = search_.run(frame.image, expected(frame), may_go_on);
    place_boards(frame.view, frame.disparities);
    tracker_.step(frame.stamp_ns, std::span(places_).first(placed_), bodies);
    if (tracker_.sight() == Sight::shirt) remember(frame.view);
  }
  void wait(int64_t now_ns) { tracker_.wait(now_ns); }

  const PersonTracker& tracker() const { return tracker_; }
  std::span<const Board> boards() const { return boards_; }  ///< of the last image, shirts or not
  float searched() const { return search_.searched(); }
  /// The board and the place that the track took last; valid while tracker().sight() is shirt.
  const Board& shirt() const { return boards_[board_of_[tracker_.shirt()]]; }
  const Place& shirt_place() const { return places_[tracker_.shirt()]; }
  const PersonTrackingParameters& parameters() const { return p_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, tracker_, height_m_, wide_, high_); }

 private:
  static constexpr size_t kMost = ChessboardFinder::kLevels * ChessboardFinder::kMostBoards;
  std::optional<ExpectedBoard> expected(const Frame& frame) const {
    if (!tracker_.active()) return std::nullopt;
    return expected_board(tracker_.at(frame.stamp_ns).position(), height_m_, wide_, high_, frame.view, p_.shirt);
  }
  void place_boards(const Viewpoint& view, const Disparities& disparities) {
    placed_ = 0;
    for (size_t i = 0; i < boards_.size(); ++i) {
      const BoardRange range = measure_range(boards_[i], disparities, view.camera, p_.shirt);
      const auto place = place_of(boards_[i], range, view, p_.shirt);
      if (!place) continue;
      board_of_[placed_] = i;
      range_m_[placed_] = range.z_m;
      places_[placed_++] = *place;
    }
  }
  void remember(const Viewpoint& view) {
    const Board& board = shirt();
    wide_ = board.box.width / board.square_px;
    high_ = board.box.height / board.square_px;
    height_m_ = height_of(board, range_m_[tracker_.shirt()], view);
  }

  PersonTrackingParameters p_;
  ShirtSearch search_;
  PersonTracker tracker_;
  std::span<const Board> boards_;
  std::array<Place, kMost> places_;
  std::array<double, kMost> range_m_{};
  std::array<size_t, kMost> board_of_{};
  size_t placed_ = 0;
  double height_m_ = 0, wide_ = 0, high_ = 0;  ///< of the shirt last seen; wide and high in squares
};

}  // namespace takt::person_tracking
