// SPDX-License-Identifier: Apache-2.0
// What the cascade looks for: the histograms of an object database's views, and their thresholds, stage by stage.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "nodes/object_detection/database.hpp"
#include "nodes/object_detection/decision.hpp"
#include "nodes/object_detection/histogram.hpp"

namespace takt::object_detection {

struct DetectorParameters {
  std::vector<double> scales = {1};  ///< of the image at which windows are searched, as parse_scales() gives them
  Stage last = Stage::cooccurrence;  ///< the stages before it run as well
  ColourBins bins = ColourBins::hsv_64x64x1;
  int orientations = 360;
  PairBins pairs;
  int window_px = 64;
  /// Size, of its views' edge, down to which an object is found, 0.5 .. 1: views are compared with at that size. What
  /// is larger only has more of everything, and that costs nothing.
  double smallest = 0.7;
  double tolerance = 0.4;      ///< share of an object that may be hidden, in automatic thresholds
  double threshold_scale = 1;  ///< factor on every threshold
};

/// "1+0.7+0.5": numbers in 0.5..1 (below half the size pixels would be left out), falling. Throws
/// std::invalid_argument.
std::vector<double> parse_scales(const std::string& text);

/// The view at a smaller scale, 0.5 .. 1, as Shrinker makes it. A pixel is object where the view's are to four fifths;
/// black ones of the object become (1, 1, 1).
ReferenceView shrunk(const ReferenceView& view, double scale);

/// Of one stage, per object and view.
struct StageReferences {
  std::vector<std::vector<Histogram>> histograms;
  std::vector<std::vector<ReferenceLimit>> limits;
};
/// Of the stages that compare histograms; empty for those beyond the last one.
using CascadeReferences = std::array<StageReferences, kHistogramStages>;

/// A view's own threshold goes before the object's, and that before the automatic one. Throws std::invalid_argument if
/// the database is empty.
CascadeReferences cascade_references(std::span<const DatabaseObject> database, const DetectorParameters& p);

}  // namespace takt::object_detection
