// SPDX-License-Identifier: Apache-2.0
// What detections are worth, against scenes whose objects are known.
#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "nodes/object_detection/scenes.hpp"
#include "rt/msg/ace/detections.hpp"

namespace takt::object_detection {

/// Counts over scenes, at one smallest score.
class Tally {
 public:
  explicit Tally(double min_score = 0) : min_score_(min_score) {}

  /// An object is detected if a box of its class covers at least half of it; a box that covers half of no object of its
  /// class is a false positive.
  void add(const Scene& scene, std::span<const Detection> boxes);

  double min_score() const { return min_score_; }
  size_t objects() const { return objects_; }
  size_t missed() const { return missed_; }
  size_t false_positives() const { return false_positives_; }
  double detected_pct() const;
  /// Share of the missed among objects of which 10 i .. 10 (i + 1) % were occluded; -1 where there was none.
  double missed_pct(size_t tenth) const;

  static constexpr size_t kTenths = 6;

 private:
  double min_score_;
  size_t objects_ = 0, missed_ = 0, false_positives_ = 0;
  struct Occluded {
    size_t objects = 0, missed = 0;
  };
  std::array<Occluded, kTenths> occluded_;
};

}  // namespace takt::object_detection
