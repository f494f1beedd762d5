// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "nodes/object_detection/scale_search.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/state_archive.hpp"

namespace takt::object_detection {

/// The cascade over all scales for images of one size. What counts of a window in the end is the last stage's error.
/// Memory is taken by the constructor; the rest allocates nothing. One thread at a time.
class Detector {
 public:
  static constexpr size_t kMostDetections = 1000;

  /// `backgrounds`: what the stage layout knows of the surroundings. Throws std::invalid_argument if windows, scales,
  /// database or backgrounds do not fit.
  Detector(int image_width, int image_height, std::span<const DatabaseObject> database, const DetectorParameters& p,
           std::span<const Photograph> backgrounds = {});

  Stage last() const { return last_; }
  /// What detections of each entry are called instead of its index in the database.
  void set_class_ids(std::vector<float> of_entry) { class_ids_ = std::move(of_entry); }
  /// In force in a stage that compares histograms; empty for one that does not run.
  const std::vector<std::vector<ReferenceLimit>>& limits(Stage stage) const {
    return references_[static_cast<size_t>(stage)].limits;
  }
  size_t scales() const { return scales_.size(); }
  const ScaleSearch& at_scale(size_t scale) const { return scales_[scale]; }
  const SearchGrid& grid() const { return scales_[0].grid(); }  ///< of the first, largest scale

  /// Searches an 8-bit BGR image. False, and nothing changed, if it has not the size or the channels.
  bool run(ImageView<const uint8_t> bgr) {
    return run(
        bgr, nullptr, [] { return true; }, [] { return true; });
  }
  /// The same as far as time allows, where `mask` (null: everywhere) has something. Colours and orientations go row of
  /// windows by row, scale by scale: `another_row()` is asked before each; the next image is searched from the row at
  /// which this one was left, so that none is left out for long, after a whole image from the first. Then
  /// co-occurrences, the best windows of all scales first: `another_window()` is asked before each. Windows that were
  /// not decided on do not pass. The result depends on images, masks and answers alone.
  template <class AnotherRow, class AnotherWindow>
  bool run(ImageView<const uint8_t> bgr, const MaskSums* mask, AnotherRow another_row, AnotherWindow another_window) {
    if (!begin(bgr, mask)) return false;
    while (searched_rows_ < rows_.size() && another_row()) search_row();
    gather_candidates();
    for (bool first = true; !candidates_.empty() && another_window(); first = false) {
      if (first) announce_candidates();
      decide_best_candidate();
    }
    end();
    return true;
  }
  /// The same until no more than `reserve_ns` of `time_left_ns()` is left. Half of what lies before that is kept for
  /// the stages behind orientations: they decide on what is reported.
  template <class TimeLeft>
  bool run_within(ImageView<const uint8_t> bgr, const MaskSums* mask, TimeLeft time_left_ns, int64_t reserve_ns) {
    const int64_t kept_ns = last_ >= Stage::cooccurrence ? std::max<int64_t>(0, time_left_ns() - reserve_ns) / 2 : 0;
    return run(
        bgr, mask, [&] { return time_left_ns() > reserve_ns + kept_ns; }, [&] { return time_left_ns() > reserve_ns; });
  }
  /// Share of the windows that the last run() decided on, 0..1; those outside the mask count.
  float searched() const;

  /// What was found at all scales (Decision::detections), rectangles in the image's pixels, the best first. Of two of
  /// one object at different scales or with different attributes, one of which covers at least half of the other, the
  /// worse is left out. Fills `out`, at most kMostDetections; returns how many.
  size_t detections(double min_score, std::span<Detection> out);
  /// Of grid(): 255 where a window passes, or its middle lies in one that passes at another scale, else 0.
  void region_of_interest(ImageView<uint8_t> roi) const;

  /// From now on a card counts co-occurrences, of all windows that need it at once. Takes 0.2 s a scale. Throws
  /// std::runtime_error if the card refuses, std::invalid_argument without that stage.
  void use(const cuda::CardUse& card);
  /// The CPU counts again. `why`: what trouble() says from now on.
  void leave_card(const std::string& why);
  /// Whether the card counts faster in some windows of noise than the CPU, by that clock.
  bool card_is_quicker(const Clock& clock);
  /// Why the CPU counts in place of the card; empty: it does not. As long as this lives.
  std::string_view trouble();
  void remember(StateArchive& archive) { TAKT_STATE(archive, first_row_); }

 private:
  struct Row {
    uint32_t scale, row;
  };
  /// A window that passed for an object and waits for the last stage.
  struct Candidate {
    float error;
    uint32_t scale, window, object;
    static bool worse(const Candidate& a, const Candidate& b) {
      return std::tie(a.error, a.scale, a.window, a.object) > std::tie(b.error, b.scale, b.window, b.object);
    }
  };
  struct Found {
    Detection detection;
    size_t scale;
  };

  bool begin(ImageView<const uint8_t> bgr, const MaskSums* mask);
  void search_row();
  void gather_candidates();
  void announce_candidates();
  void decide_best_candidate();
  void end();

  int width_, height_;
  Stage last_;
  CascadeReferences references_;
  std::vector<ScaleSearch> scales_;
  std::vector<Row> rows_;  ///< of windows, at all scales
  size_t windows_ = 0;     ///< at all scales
  ImageView<const uint8_t> image_;
  const MaskSums* mask_ = nullptr;
  size_t first_row_ = 0, searched_rows_ = 0, searched_windows_ = 0;
  bool met_card_ = false;                        ///< in a job
  std::vector<Candidate> candidates_;            ///< a heap, the best in front
  std::vector<WindowOfObject> at_one_scale_;     ///< of these
  std::string refused_;                          ///< why there is no card
  std::vector<std::vector<uint8_t>> undecided_;  ///< by scale: windows that were candidates to the end
  std::vector<size_t> first_of_name_;            ///< of each entry: the first of the same object
  std::vector<float> class_ids_;                 ///< of each entry
  std::vector<Detection> at_scale_;
  std::vector<Found> found_;
};

}  // namespace takt::object_detection
