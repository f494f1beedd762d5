// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <vector>

#include "nodes/object_detection/colour_stage.hpp"
#include "nodes/object_detection/database.hpp"
#include "nodes/object_detection/decision.hpp"

namespace takt::object_detection {

struct DetectorParameters {
  ColourBins bins = ColourBins::hsv_64x64x1;
  int window_px = 64;
  double tolerance = 0.36;  ///< added to automatic thresholds: 1 - 0.8^2, an object at 0.8 times its reference's size
  double threshold_scale = 1;  ///< factor on every threshold
};

/// The cascade for images of one size: its colour stage, so far the only one, and the decision on what it found.
/// Memory is taken by the constructor; run() allocates nothing. One thread at a time.
class Detector {
 public:
  /// Throws std::invalid_argument if grid or database do not fit.
  Detector(int image_width, int image_height, std::span<const DatabaseObject> database, const DetectorParameters& p);

  const SearchGrid& grid() const { return grid_; }
  /// Per object and view: mass and the threshold in force.
  std::span<const std::vector<ReferenceLimit>> limits() const { return limits_; }

  /// Searches an 8-bit BGR image. False, and nothing changed, if it has not the size or the channels.
  bool run(ImageView<const uint8_t> bgr) {
    return run(bgr, [] { return true; });
  }
  /// The same as far as `may_go_on()` allows, which is asked before each row of windows: windows beyond that do not
  /// pass. The next image is searched from the row at which this one was left, so that none is left out for long; after
  /// a whole image from the top. The result depends on images and answers alone.
  template <class MayGoOn>
  bool run(ImageView<const uint8_t> bgr, MayGoOn may_go_on) {
    if (!begin(bgr)) return false;
    for (searched_rows_ = 0; searched_rows_ < grid_.rows && may_go_on(); ++searched_rows_) colour_.search_row();
    end();
    return true;
  }
  /// Share of the windows that the last run() searched, 0..1.
  float searched() const { return static_cast<float>(searched_rows_) / static_cast<float>(grid_.rows); }
  Decision& decision() { return decision_; }
  std::span<const uint16_t> missing() const { return colour_.missing(); }

 private:
  bool begin(ImageView<const uint8_t> bgr);
  void end();

  SearchGrid grid_;
  std::vector<std::vector<Histogram>> references_;
  std::vector<std::vector<ReferenceLimit>> limits_;
  ColourStage colour_;
  Decision decision_;
  int first_row_ = 0, searched_rows_ = 0;
};

}  // namespace takt::object_detection
