// SPDX-License-Identifier: Apache-2.0
// What the errors of a stage mean: which windows pass, and which objects are there (thesis Eq. 3.18, in the OR form of
// algorithm reference 6.7).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/messages.hpp"

namespace takt::object_detection {

/// One reference view: its mass (pixels) and the error (0..1) below which a window passes.
struct ReferenceLimit {
  uint32_t mass = 0;
  double threshold = 0;
};

/// Memory is taken by the constructor; the rest allocates nothing. One thread at a time.
class Decision {
 public:
  static constexpr float kFailed = 2.0f;  ///< error of a window that no reference of the object passes

  /// `objects`: per object its references, in the stage's order.
  Decision(const SearchGrid& grid, std::span<const std::vector<ReferenceLimit>> objects);

  /// Takes the stage's missing masses (windows x references). A window passes for an object if the error of at least
  /// one of its references is below that reference's threshold; it passes at all if it does for one object.
  void decide(std::span<const uint16_t> missing);

  /// After decide(): per window the smallest error of the object's references that pass, else kFailed.
  std::span<const float> errors(size_t object) const;
  /// After decide(): the region of interest, columns x rows, 255 where a window passes, else 0.
  void region_of_interest(ImageView<uint8_t> roi) const;
  size_t passed_windows() const;

  /// After decide(): one detection per object and group of touching windows that pass (8 neighbours), at the group's
  /// window with the smallest error; of equals the upper left one. class_id is the object's index, score 1 - error.
  /// Those below `min_score` are left out: thresholds are loose, so that the next stage misses nothing. Fills `out`
  /// with the best, best first (equal scores: lower class, then upper left first); returns how many.
  size_t detections(double min_score, std::span<Detection> out);

 private:
  struct Limit {
    uint32_t below;  ///< a missing mass below this passes
    float mass;
  };
  void decide_window(size_t window, const uint16_t* missing);
  size_t best_of_group(std::span<const float> errors, size_t seed);

  SearchGrid grid_;
  std::vector<std::vector<Limit>> limits_;
  std::vector<float> errors_;  ///< object by object
  std::vector<uint8_t> passed_, visited_;
  std::vector<uint32_t> stack_;
};

}  // namespace takt::object_detection
