// SPDX-License-Identifier: Apache-2.0
// Internal: many windows beside one another through a cascade at once.
#pragma once
#include <cstdint>
#include <span>

namespace takt::traffic_signs {

/// The corners of a rectangle in the sums, relative to the window's: its sum is a - b - c + d.
struct Corners {
  int32_t a, b, c, d;
};

/// A stump for one level.
struct PlacedStump {
  Corners rects[3];
  float weights[3];
  float threshold, below, otherwise;
};

struct PlacedStage {
  uint32_t stumps;
  float threshold;
};

/// A cascade for one level.
struct PlacedCascade {
  std::span<const PlacedStump> stumps;  ///< stage after stage
  std::span<const PlacedStage> stages;
  Corners inner;  ///< the window without its rim of one pixel, which the variance is taken of
  double inner_area;
};

constexpr uint8_t kFlat = 255;         ///< too little contrast to be looked at
constexpr uint8_t kNotSearched = 254;  ///< not wanted

/// For `count` windows beside one another, the first with its upper left corner at `sums` and `squares`: how many
/// stages it passes, or kFlat, or kNotSearched where `wanted` is 0. `wanted` null: all. Reads up to a vector beyond the
/// last.
void pass_windows(const PlacedCascade& cascade, const int32_t* sums, const int32_t* squares, int count,
                  const uint8_t* wanted, uint8_t* passed);

}  // namespace takt::traffic_signs
