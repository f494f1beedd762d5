// SPDX-License-Identifier: Apache-2.0
// Histograms of reference views and their comparison, in the obvious form (thesis Sec. 3.4.2; R-6.2 -
// 6.5, 6.8). The search over windows is in the stages.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/colour_bins.hpp"
#include "nodes/object_detection/cooccurrence_counter.hpp"
#include "nodes/object_detection/orientation_bins.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// Counts per bin and their sum, the mass.
struct Histogram {
  std::vector<uint32_t> count;
  uint32_t mass = 0;
};

/// Whether a pixel of a reference view is none of the object: exactly (0, 0, 0).
inline bool is_background(ImageView<const uint8_t> view, int x, int y) {
  return (view.at(x, y, 0) | view.at(x, y, 1) | view.at(x, y, 2)) == 0;
}

/// Colour histogram of a reference view: 8-bit BGR, at most 255 x 255 pixels; pixels of exactly (0, 0, 0) are
/// background and not counted.
Histogram colour_histogram(ImageView<const uint8_t> view, ColourBins bins);
/// Histogram of its oriented gradients; pixels whose 3 x 3 neighbourhood has background in it, or ends, are not
/// counted: the edge there is none of the object's. The mass may be 0.
Histogram orientation_histogram(ImageView<const uint8_t> view, const OrientationBins& bins);

/// How pairs of pixels are told apart.
struct PairBins {
  int colours = 20;    ///< 5 or 20
  int distances = 25;  ///< 1 .. kMaxDistance
};
/// Colour co-occurrence histogram, in the order of pair_bin(); background takes part in no pair. The mass may be 0.
Histogram cooccurrence_histogram(ImageView<const uint8_t> view, const PairBins& bins);

/// Mass of the reference that the window lacks: sum over bins of max(0, reference - window) (thesis Eq. 3.14). What the
/// window has beyond the reference costs nothing.
uint32_t missing_mass(std::span<const uint32_t> window, std::span<const uint32_t> reference);
/// The same over the reference's mass: 0 = all found, 1 = nothing found; 0 for a reference without mass.
double intersection_error(const Histogram& window, const Histogram& reference);

/// Largest thresholds that automatic_threshold gives: of colours, orientations, and co-occurrences, which lose more.
/// Those of others (0.6 in, 0.75 in C-7) are for views compared with at their full size.
constexpr double kColourCap = 0.5, kOrientationCap = 0.5, kCooccurrenceCap = 0.64;
/// Start value of an object's threshold: 1.25 times the 90 % quantile (nearest rank) of the error of every view against
/// every other view of the object, and `tolerance` on top, at most `cap`, which is also the
/// value for a single view. The views say nothing of what a scene takes away: an occlusion of a share q takes about q
/// of the reference's mass (6.8); that is the tolerance. Of pairs of pixels both must be seen: there it is
/// 1 - (1 - q)^2.
double automatic_threshold(std::span<const Histogram> views, double tolerance, double cap);

}  // namespace takt::object_detection
