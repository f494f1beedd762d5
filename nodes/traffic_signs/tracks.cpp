// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/tracks.hpp"

#include <algorithm>
#include <array>

namespace takt::traffic_signs {

void Tracks::update(std::span<const Sighting> sightings, bool complete) {
  const size_t before = tracks_.size();
  std::array<bool, kMost> matched{};
  for (const Sighting& sighting : sightings) {
    size_t best = before;
    double most = parameters_.overlap;
    for (size_t i = 0; i < before; ++i) {
      const double overlap = intersection_over_union(tracks_[i].last.box, sighting.box);
      if (matched[i] || tracks_[i].last.sign != sighting.sign || overlap < most) continue;
      most = overlap;
      best = i;
    }
    if (best == before) {
      if (tracks_.size() < kMost) tracks_.push_back({sighting, 1, 0, parameters_.confirm <= 1});
      continue;
    }
    matched[best] = true;
    Track& track = tracks_[best];
    track = {sighting, track.seen + 1, 0, track.confirmed || track.seen + 1 >= parameters_.confirm};
  }
  for (size_t i = 0; i < before; ++i) {
    if (matched[i]) continue;
    tracks_[i].seen = 0;
    tracks_[i].missed += complete;
  }
  std::erase_if(tracks_, [&](const Track& track) { return track.missed >= parameters_.drop; });
  expected_.clear();
  for (const Track& track : tracks_) expected_.push_back(track.last);
}

bool Tracks::any_confirmed() const {
  return std::any_of(tracks_.begin(), tracks_.end(), [](const Track& track) { return track.confirmed; });
}

}  // namespace takt::traffic_signs
