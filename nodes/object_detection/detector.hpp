// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "nodes/object_detection/colour_stage.hpp"
#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/object_detection/database.hpp"
#include "nodes/object_detection/decision.hpp"
#include "nodes/object_detection/orientation_stage.hpp"

namespace takt::object_detection {

struct DetectorParameters {
  Stage last = Stage::cooccurrence;  ///< the stages before it run as well
  ColourBins bins = ColourBins::hsv_64x64x1;
  int orientations = 360;
  PairBins pairs;
  int window_px = 64;
  double tolerance = 0.36;  ///< added to automatic thresholds: 1 - 0.8^2, an object at 0.8 times its reference's size
  double threshold_scale = 1;  ///< factor on every threshold
};

/// The cascade for images of one size. A window is compared with an object in a stage only if it passed for it in the
/// stage before; what counts in the end is the last stage's error. Memory is taken by the constructor; run() allocates
/// nothing. One thread at a time.
class Detector {
 public:
  /// Per object and view mass and threshold.
  using Limits = std::vector<std::vector<ReferenceLimit>>;

  /// Throws std::invalid_argument if grid or database do not fit.
  Detector(int image_width, int image_height, std::span<const DatabaseObject> database, const DetectorParameters& p);

  const SearchGrid& grid() const { return grid_; }
  Stage last() const { return last_; }
  /// In force in a stage; empty for one that does not run.
  const Limits& limits(Stage stage) const { return references_[static_cast<size_t>(stage)].limits; }

  /// Searches an 8-bit BGR image. False, and nothing changed, if it has not the size or the channels.
  bool run(ImageView<const uint8_t> bgr) {
    return run(
        bgr, [] { return true; }, [] { return true; });
  }
  /// The same as far as time allows. Colours and orientations go row of windows by row: `another_row()` is asked before
  /// each; the next image is searched from the row at which this one was left, so that none is left out for long, after
  /// a whole image from the top. Then co-occurrences, best windows first: `another_window()` is asked before each.
  /// Windows that were not decided on do not pass. The result depends on images and answers alone.
  template <class AnotherRow, class AnotherWindow>
  bool run(ImageView<const uint8_t> bgr, AnotherRow another_row, AnotherWindow another_window) {
    if (!begin(bgr)) return false;
    for (searched_rows_ = 0; searched_rows_ < grid_.rows && another_row(); ++searched_rows_) search_row();
    gather_candidates();
    while (!candidates_.empty() && another_window()) decide_best_candidate();
    end();
    return true;
  }
  /// Share of the windows that the last run() decided on, 0..1.
  float searched() const;
  Decision& decision() { return decision_; }
  /// Of the colour stage.
  std::span<const uint16_t> missing() const { return colour_.missing(); }

 private:
  struct StageReferences {
    std::vector<std::vector<Histogram>> histograms;
    Limits limits;
  };
  /// A window that passed for an object and waits for the last stage.
  struct Candidate {
    float error;
    uint32_t window, object;
    static bool worse(const Candidate& a, const Candidate& b) {
      return std::tie(a.error, a.window, a.object) > std::tie(b.error, b.window, b.object);
    }
  };

  static std::array<StageReferences, kStages> references_of(std::span<const DatabaseObject> database,
                                                            const DetectorParameters& p);
  const StageReferences& references(Stage stage) const { return references_[static_cast<size_t>(stage)]; }
  bool begin(ImageView<const uint8_t> bgr);
  void search_row();
  void gather_candidates();
  void decide_best_candidate();
  void end();

  SearchGrid grid_;
  Stage last_;
  std::array<StageReferences, kStages> references_;
  std::vector<StageLimits> limits_;
  ColourStage colour_;
  std::optional<OrientationStage> orientation_;
  std::optional<CooccurrenceStage> cooccurrence_;
  Decision decision_;
  ImageView<const uint8_t> image_;
  int first_row_ = 0, searched_rows_ = 0;
  std::vector<Candidate> candidates_;  ///< a heap, the best in front
  std::vector<uint8_t> undecided_;     ///< windows that were candidates to the end
};

}  // namespace takt::object_detection
