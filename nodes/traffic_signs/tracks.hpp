// SPDX-License-Identifier: Apache-2.0
// A sign counts once it was seen in consecutive images: a false one mostly shows in a single one (thesis Sec. 3.5.4;
//
#pragma once
#include <span>
#include <vector>

#include "nodes/traffic_signs/sign_detector.hpp"
#include "rt/state_archive.hpp"

namespace takt::traffic_signs {

struct TrackParameters {
  int confirm = 2;       ///< consecutive images with the sign
  int drop = 3;          ///< consecutive images without it
  double overlap = 0.3;  ///< intersection over union with the last box, at least
};

struct Track {
  Sighting last;
  int seen = 0, missed = 0;  ///< in a row; one of them is 0
  bool confirmed = false;
};

/// Memory is taken by the constructor; the rest allocates nothing.
class Tracks {
 public:
  static constexpr size_t kMost = 64;
  explicit Tracks(const TrackParameters& parameters) : parameters_(parameters) {
    tracks_.reserve(kMost), expected_.reserve(kMost);
  }

  /// From the next image on; what is confirmed stays so.
  void tune(const TrackParameters& parameters) { parameters_ = parameters; }
  /// Takes the sightings of one image, the strongest first: each goes on with the track of its sign that overlaps it
  /// most, or begins one. `complete`: what was expected was searched, so that not to be seen counts as a miss.
  void update(std::span<const Sighting> sightings, bool complete);
  std::span<const Track> tracks() const { return tracks_; }
  /// The last sighting of each track.
  std::span<const Sighting> expected() const { return expected_; }
  bool any_confirmed() const;
  void remember(StateArchive& archive) { TAKT_STATE(archive, tracks_, expected_); }

 private:
  TrackParameters parameters_;
  std::vector<Track> tracks_;
  std::vector<Sighting> expected_;
};

}  // namespace takt::traffic_signs
