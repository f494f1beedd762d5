// SPDX-License-Identifier: Apache-2.0
// What bins, thresholds and numbers of references do to each stage by itself, on all windows (thesis Fig. 3.20).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nodes/object_detection/references.hpp"
#include "nodes/object_detection/scenes.hpp"

namespace takt::object_detection {

/// One stage with one choice of bins, over scenes that show one object each.
struct StageFigures {
  double time_ms = 0;       ///< median of a thread's CPU time: preparation, all windows, all references of one object
  double excluded_pct = 0;  ///< windows at or above the threshold
  double missed_pct = 0;    ///< objects of which no window that covers at least half of them lies below it
  /// Mean of 1 - e / E: e the least error of the windows that cover at least half of the object, E the median of those
  /// that do not touch it. 1: the object alone stands out; 0: it does not.
  double contrast = 0;
};

/// Where the stage has what `p` says of bins and window; the object's threshold, automatic or given, times
/// `p.threshold_scale`. The first `references` views are compared with, again from the first where there are fewer; 0:
/// all.
StageFigures study_stage(Stage stage, std::span<const DatabaseObject> database, std::span<const Scene> scenes,
                         const DetectorParameters& p, size_t references = 0);

}  // namespace takt::object_detection
