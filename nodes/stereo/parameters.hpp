// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace takt::stereo {

/// What two pixels cost when they are said to show the same point; every kind is truncated at c_max.
enum class CostKind : uint8_t {
  gradient,  ///< |dGx| + |dGy| on the grey image, G = central difference / 2, the sum rounded up
  ssd,       ///< sum over channels of squared differences (thesis Eq. 3.1, 3.3 with w = 1)
  sad,       ///< sum over channels of absolute differences
  census,    ///< of the 48 neighbours in 7 x 7 grey pixels, how many are darker than the centre in one image only
  rss,       ///< square root of ssd
  mixed      ///< w ssd + (1 - w) / 2 ssd of both derivatives of each channel (thesis Eq. 3.1 - 3.3, E-02)
};

/// How the costs around a pixel become its own (thesis Sec. 3.2.2).
enum class Aggregation : uint8_t {
  square,           ///< mean over n_square x n_square, then the minimum filter
  adaptive_window,  ///< the smallest (or largest, or mean) of square windows of three sizes, each minimum filtered
  boundary,         ///< weighted mean of what lies within n_square / 2 and before the next edge
  adaptive_weight   ///< weighted mean over n_square x n_square by distance and colour (thesis Eq. 3.5)
};

/// What an adaptive window takes of its sizes.
enum class Combination : uint8_t { min, max, mean };

/// How the aggregated costs become a disparity (thesis Sec. 3.2.3).
enum class Selection : uint8_t {
  winner,      ///< smallest cost of the pixel, smallest disparity on ties
  scanline,    ///< cheapest path through a row; a step of 1 px costs p1, of more p2
  semi_global  ///< smallest sum of the cheapest paths to the pixel from left, right and above (Hirschmueller 2008)
};

constexpr int default_truncation(CostKind kind) {
  return kind == CostKind::gradient ? 10 : kind == CostKind::census ? 24 : 50;
}

constexpr int kLargestWindow = 31;  ///< edge, px

/// Settings of a Matcher. The defaults are the recommended fast ones; quality() the recommended ones for weak texture
/// and slanted surfaces; the thesis's own are {cost = ssd, c_max = 50}.
struct MatcherParameters {
  int disparities = 150;  ///< search range 0 .. disparities - 1, 1..512 px
  CostKind cost = CostKind::gradient;
  double intensity_weight = 1;  ///< w of the cost `mixed`, 0..1
  int c_max = 0;                ///< truncation of the cost; 0: default_truncation(cost)
  Aggregation aggregation = Aggregation::square;
  Combination combination = Combination::min;  ///< of an adaptive window
  int n_square = 15;           ///< edge of the window, odd, 1..31 px (thesis Eq. 3.4); the largest of an adaptive one
  int n_min = 5;               ///< edge of the minimum filter, odd, 1..n_square px (shiftable windows)
  double edge_threshold = 30;  ///< gradient magnitude of an edge that bounds a window, grey levels
  double gamma_distance = 7.5, gamma_colour = 20;  ///< falling-off of adaptive weights, px and Euclidean BGR levels
  Selection selection = Selection::winner;
  int p1 = 0, p2 = 0;      ///< costs of a path's step by 1 px, by more; 0: a tenth and six of c_max; semi_global 14, 60
  bool median = false;     ///< 3 x 3 median filter on the disparities
  bool subpixel = false;   ///< parabola through the winner's cost and its neighbours', 1/64 px
  int min_confidence = 0;  ///< pixels with a confidence below it are invalid; 0..255, 0 rejects nothing
  int uniqueness = 0;      ///< second best cost must exceed the best by this share of itself; 0..255 of 256, 0 is off
  bool left_right_check = false;  ///< reject where |d_left - d_right| > 1

  int truncation() const { return c_max > 0 ? c_max : default_truncation(cost); }
  /// Largest sum of one window; the confidence is relative to it.
  int max_sum() const { return truncation() * n_square * n_square; }

  /// Costs of a path's step by one disparity and by more (p1, p2 or their defaults).
  int step_once() const {
    return p1 > 0 ? p1 : selection == Selection::semi_global ? 14 : std::max(1, truncation() / 10);
  }
  int step_twice() const {
    return p2 > 0 ? p2 : selection == Selection::semi_global ? 60 : std::max(1, truncation() * 6 / 10);
  }

  static MatcherParameters quality() {
    MatcherParameters p;
    p.cost = CostKind::census;
    p.n_square = p.n_min = 1;
    p.selection = Selection::semi_global;
    p.median = true;
    return p;
  }
};

/// Says what is wrong with the parameters for images of that size, if anything.
std::optional<std::string> problem(const MatcherParameters& p, int width, int height, int channels);

/// `made` with what of `wanted` takes no other memory: min_confidence, prices of steps, weights, the threshold of edges
/// and how the windows are combined.
MatcherParameters tuned(const MatcherParameters& made, const MatcherParameters& wanted);

/// Confidence 0..255 of a window sum (thesis Eq. 3.6, corrected): zeta = (c_max N^2 - sum) / (c_max N^2), rounded.
constexpr uint8_t confidence_of(int sum, int max_sum) {
  return static_cast<uint8_t>((int64_t{255} * (max_sum - sum) + max_sum / 2) / max_sum);
}

/// Grey value of a BGR pixel: ITU-R BT.601 weights in 1/256.
constexpr uint8_t grey_of(int b, int g, int r) { return static_cast<uint8_t>((29 * b + 150 * g + 77 * r + 128) >> 8); }

/// Twice the derivative of a grey image, from the two neighbours of a pixel, saturated to -128..127.
constexpr int8_t twice_derivative(int before, int after) {
  return static_cast<int8_t>(std::clamp(after - before, -128, 127));
}

/// Neighbour `bit` (0..47) of the census window, row by row without the centre, as offset from it.
constexpr int kCensusRadius = 3, kCensusBits = 48;
struct CensusOffset {
  int x, y;
};
constexpr CensusOffset census_offset(int bit) {
  const int edge = 2 * kCensusRadius + 1, at = bit + (bit >= kCensusBits / 2 ? 1 : 0);
  return {at % edge - kCensusRadius, at / edge - kCensusRadius};
}

/// Sub-pixel disparities are a whole number and a fraction in 1/64 px, stored as 0..63 for -32/64 .. 31/64.
constexpr int kFractions = 64, kNoFraction = 32;

/// Fraction of the vertex of the parabola through the costs at d - 1, d and d + 1, of which the middle one is the
/// least.
constexpr int fraction_of(int before, int best, int after) {
  const int slope = before - after, bend = before - 2 * best + after;
  if (bend <= 0) return kNoFraction;
  const int doubled = kFractions * slope / bend;  // of half the quotient slope / bend, rounded to the nearest
  return std::clamp((doubled + (doubled < 0 ? -1 : 1)) / 2 + kNoFraction, 0, kFractions - 1);
}

}  // namespace takt::stereo
