// SPDX-License-Identifier: Apache-2.0
// What the errors of a stage mean: which windows pass, and which objects are there (thesis Eq. 3.18, in the OR form of
//
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// One reference view: its mass (pixels, or pairs of them) and the error (0..1) below which a window passes.
struct ReferenceLimit {
  uint32_t mass = 0;
  double threshold = 0;
};

constexpr float kFailed = 2.0f;  ///< error of a window that no reference of the object passes

/// The limits of a stage.
class StageLimits {
 public:
  /// `objects`: per object its references, in the stage's order.
  explicit StageLimits(std::span<const std::vector<ReferenceLimit>> objects);

  /// From the missing masses of the object's references in a window: the smallest error of those that pass, else
  /// kFailed. A reference passes if its error is below its threshold; one without mass always does.
  template <class Mass>
  float error(size_t object, const Mass* missing) const {
    float best = kFailed;
    for (const Limit& limit : limits_[object]) {
      const Mass mass = *missing++;
      if (mass < limit.below) best = std::min(best, static_cast<float>(mass) / limit.mass);
    }
    return best;
  }

 private:
  struct Limit {
    uint32_t below;  ///< a missing mass below this passes
    float mass;
  };
  std::vector<std::vector<Limit>> limits_;
};

/// The order in which detections are reported: by score, of equals the lower class, then the upper left one first.
bool better(const Detection& a, const Detection& b);

/// The merged error map of each object: what is known of each window after the last stage that looked at it. Memory is
/// taken by the constructor; the rest allocates nothing. One thread at a time.
class Decision {
 public:
  Decision(const SearchGrid& grid, size_t objects);

  /// No window passes.
  void clear();
  /// A window passes for an object with an error, or fails (kFailed).
  void set(size_t object, size_t window, float error) { set(object, window, error, grid_.window(window)); }
  /// The same, and where around the window the object is.
  void set(size_t object, size_t window, float error, const Placement& at) {
    errors_[object * windows_ + window] = error;
    at_[object * windows_ + window] = at;
  }
  /// Per window the object's error, or kFailed.
  std::span<const float> errors(size_t object) const { return std::span(errors_).subspan(object * windows_, windows_); }
  size_t objects() const { return errors_.size() / windows_; }

  /// The region of interest, columns x rows, 255 where a window passes for any object, else 0.
  void region_of_interest(ImageView<uint8_t> roi) const;
  size_t passed_windows() const;
  /// For any object?
  bool passes(size_t window) const;

  /// One detection per object and group of touching windows that pass (8 neighbours): score 1 - the smallest error in
  /// the group, class_id the object's index. Several windows may show enough of an object, and it is in their midst:
  /// around the window with the smallest error (of equals the upper left one) at the mean of those whose middle it
  /// covers, each weighted with how much its error is below the smallest + kNearlyBest. Those below `min_score` are
  /// left out. Fills `out` with the best, best first (equal scores: lower class, then upper left first); returns how
  /// many.
  size_t detections(double min_score, std::span<Detection> out);

 private:
  static constexpr float kNearlyBest = 0.1f;

  size_t best_of_group(std::span<const float> errors, size_t seed);
  Detection detection(size_t object, size_t best) const;

  SearchGrid grid_;
  size_t windows_;
  std::vector<float> errors_;  ///< object by object
  std::vector<Placement> at_;  ///< likewise, where a window passes
  std::vector<uint8_t> visited_;
  std::vector<uint32_t> stack_;
};

}  // namespace takt::object_detection
