// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace takt::stereo {

/// What two pixels cost when they are said to show the same point.
enum class CostKind : uint8_t {
  gradient,  ///< min(c_max, |dGx| + |dGy|) on the grey image, G = central difference / 2, the sum rounded up
  ssd,       ///< min(c_max, sum over channels of squared differences) (thesis Eq. 3.1, 3.3 with w = 1)
  sad        ///< min(c_max, sum over channels of absolute differences)
};

/// Settings of a Matcher. The defaults are the recommended ones; the thesis's own are {cost = ssd, c_max = 50}.
struct MatcherParameters {
  int disparities = 150;  ///< search range 0 .. disparities - 1, 1..512 px
  CostKind cost = CostKind::gradient;
  int c_max = 0;           ///< truncation of the cost; 0: default of the kind (gradient 10, ssd and sad 50)
  int n_square = 15;       ///< edge of the summing window, odd, 1..31 px (thesis Eq. 3.4)
  int n_min = 5;           ///< edge of the minimum filter, odd, 1..n_square px (shiftable windows)
  int min_confidence = 0;  ///< pixels with a confidence below it are invalid; 0..255, 0 rejects nothing
  int uniqueness = 0;      ///< second best cost must exceed the best by this share of itself; 0..255 of 256, 0 is off
  bool left_right_check = false;  ///< reject where |d_left - d_right| > 1; doubles the time

  int truncation() const { return c_max > 0 ? c_max : (cost == CostKind::gradient ? 10 : 50); }
  /// Largest sum of one window; the confidence is relative to it.
  int max_sum() const { return truncation() * n_square * n_square; }
  bool rejects() const { return min_confidence > 0 || uniqueness > 0 || left_right_check; }
};

/// Says what is wrong with the parameters for images of that size, if anything.
std::optional<std::string> problem(const MatcherParameters& p, int width, int height, int channels);

/// Confidence 0..255 of a window sum (thesis Eq. 3.6, corrected): zeta = (c_max N^2 - sum) / (c_max N^2), rounded.
inline uint8_t confidence_of(int sum, int max_sum) {
  return static_cast<uint8_t>((int64_t{255} * (max_sum - sum) + max_sum / 2) / max_sum);
}

/// Grey value of a BGR pixel: ITU-R BT.601 weights in 1/256.
inline uint8_t grey_of(int b, int g, int r) { return static_cast<uint8_t>((29 * b + 150 * g + 77 * r + 128) >> 8); }

/// Twice the derivative of a grey image, from the two neighbours of a pixel, saturated to -128..127.
inline int8_t twice_derivative(int before, int after) {
  return static_cast<int8_t>(std::clamp(after - before, -128, 127));
}

}  // namespace takt::stereo
