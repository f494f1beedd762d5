// SPDX-License-Identifier: Apache-2.0
// How well the person is tracked on generated walks, beside two trackers that anybody would write first.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/person_tracking/generated_walk.hpp"
#include "nodes/person_tracking/person_tracking.hpp"

namespace takt::person_tracking {

/// A track, or a shirt, farther than this from the person is another's.
constexpr double kFalse_m = 0.75;
/// Of his shirt at least so much must be in view for an image to count as one that shows him.
constexpr double kShown = 0.5;

/// One way to track on all frames of some walks.
struct TrackFigures {
  int tracked = 0;                            ///< frames with a track within kFalse_m of the person
  int tracked_shown = 0;                      ///< of those that show him
  int false_locks = 0;                        ///< frames with a track of something else
  int lost = 0, recovered = 0;                ///< times that a track ended, and began anew
  std::vector<double> position_m;             ///< errors of right tracks
  std::vector<double> hidden_m;               ///< of those in frames without a sighting
  std::vector<double> speed_m_s, turn_rad_s;  ///< errors of the set-point in every frame; without a track it is 0
};

struct WalkFigures {
  int frames = 0, shown = 0;
  int sighted = 0, sighted_shown = 0;  ///< frames with a shirt taken
  int wrong_sightings = 0;             ///< of them, of something else
  TrackFigures filter;                 ///< the tracker
  TrackFigures hold;                   ///< the last sighting, for a second
  TrackFigures constant;               ///< the last two sightings continued, for a second
  std::vector<double> time_ms;         ///< CPU time of each frame, disparities apart
};

/// Walks 0 .. walks - 1 of a seed. Disparities come from the stereo matcher that the graph uses; the same sightings go
/// to all three.
WalkFigures measure_walks(const WalkParameters& walk, const PersonTrackingParameters& tracking, uint64_t seed,
                          int walks, int frames);

}  // namespace takt::person_tracking
