// SPDX-License-Identifier: Apache-2.0
// How many signs are found and what is taken for one (thesis Tab. 3.4).
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "nodes/traffic_signs/sign_scenes.hpp"
#include "nodes/traffic_signs/tracks.hpp"

namespace takt::traffic_signs {

/// Of one class.
struct SignScore {
  int shown = 0, hit = 0;  ///< signs (or tracks, or passages), and those found: right class, overlap of at least a half
  int false_positives = 0;
};

struct Scores {
  std::vector<SignScore> of_class;   ///< in the order of the list of signs
  int images = 0, images_false = 0;  ///< images (or passages); those in which anything was found that is not there
  std::vector<double> times_ms;      ///< thread CPU time of each search
};

/// A sign in an image by its index in the list; the list's size: none of them.
struct ShownSign {
  size_t sign;
  Box box;
};

/// Adds one image: what is found in it against what is shown.
void score_image(std::span<const ShownSign> shown, std::span<const Sighting> found, Scores& scores);

/// What a generated scene shows, by the list.
std::vector<ShownSign> shown_in(const SignScene& scene, std::span<const SignModel> signs);

/// Generated scenes 0 .. count - 1 of a seed, each on its own, without a budget.
Scores score_scenes(SignDetector& detector, uint64_t seed, int count);

/// Generated passages of 12 frames; hit: the sign was confirmed in one of them at the right place; false positives:
/// confirmed tracks of anything else. Each search ends after the budget (of CPU time, as the node's reservation would).
Scores score_passages(const std::vector<SignModel>& signs, uint64_t seed, int count, double budget_s,
                      const TrackParameters& tracks = {});

/// Index in the list by name; its size if there is none.
size_t sign_index(std::span<const SignModel> signs, std::string_view name);

}  // namespace takt::traffic_signs
