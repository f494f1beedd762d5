// SPDX-License-Identifier: Apache-2.0
// How far the verdict on a pixel can be trusted: blooming and hard shadow borders look like the end of the floor
// (thesis Sec. 4.2.1, limits; ).
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::ground_map {

constexpr uint8_t kSure = 255;

struct DoubtParameters {
  int bloom_value = 250;                              ///< from this value on the sensor may have been flooded
  double shade_deepest = 0.3, shade_faintest = 0.85;  ///< light that a shadow leaves, of that beside it
  int shade_saturation = 10;                          ///< by how much saturation may differ there, to each side
  uint8_t doubtful = 64;  ///< confidence, of 255, of a pixel that may be the one or the other
};

/// For every (saturation, value) the confidence in "ground" or "not ground". Doubtful is what is as bright as a flooded
/// sensor, and what is not ground but would be in another light: a known texture of nearly its saturation, by a factor
/// within the shade's limits darker or brighter. All else is sure. Allocates in the constructor only.
class ConfidenceTable {
 public:
  explicit ConfidenceTable(const DoubtParameters& parameters);
  /// From the next rebuild() on.
  void tune(const DoubtParameters& parameters);
  /// `is_ground`: 256 x 256 bytes, index 256 v + s, 1 ground, 0 not.
  void rebuild(const uint8_t* is_ground);
  /// 256 x 256 bytes, index 256 v + s. Before the first rebuild nothing is ground.
  const uint8_t* table() const { return table_.data(); }

 private:
  /// Values low .. high - 1; empty: low >= high.
  struct Values {
    int low, high;
  };
  DoubtParameters p_;
  std::array<std::array<Values, 2>, 256> other_light_;  ///< per value: those that it may be a shade of, or lit beside
  std::vector<int32_t> above_;                          ///< 257 x 256: ground of that saturation at smaller values
  std::vector<uint8_t> table_;
};

/// Confidence of the pixels of one image.
struct Confidence {
  const uint8_t* table = nullptr;  ///< null: all is sure
  ImageView<const uint8_t> saturation, value;
  uint8_t at(int x, int y) const { return table ? table[256 * value.at(x, y) + saturation.at(x, y)] : kSure; }
};

}  // namespace takt::ground_map
