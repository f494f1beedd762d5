// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/object_detection/colour_stage.hpp"
#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/object_detection/decision.hpp"
#include "nodes/object_detection/layout_stage.hpp"
#include "nodes/object_detection/mask_sums.hpp"
#include "nodes/object_detection/orientation_stage.hpp"
#include "nodes/object_detection/references.hpp"
#include "nodes/object_detection/shrink.hpp"
#include "rt/msg/ace/detections.hpp"

namespace takt::object_detection {

/// The cascade at one scale of the image, in portions. A window is compared with an object in a stage only if it passed
/// for it in the stage before. Memory is taken by the constructor; the rest allocates nothing. One thread at a time.
class ScaleSearch {
 public:
  /// `references` and `layout`, empty without that stage, are copied. Throws std::invalid_argument if the windows do
  /// not fit.
  ScaleSearch(int image_width, int image_height, double scale, int reference_px, const CascadeReferences& references,
              const std::vector<LayoutObject>& layout, const DetectorParameters& p);

  const SearchGrid& grid() const { return grid_; }  ///< in the scaled image
  Decision& decision() { return decision_; }
  const Decision& decision() const { return decision_; }
  /// Of the colour stage.
  std::span<const uint16_t> missing() const { return colour_.missing(); }
  /// Rectangle of a detection in the image before scaling, px.
  void to_image(Detection& detection) const;

  /// No window passes, begin() was not called.
  void clear();
  bool begun() const { return begun_; }
  /// Scales the image, which must stay until the last call for it; search_row() begins at that row of windows. Windows
  /// that have no pixel other than 0 of `mask` are not searched and do not pass; null: all are searched.
  void begin(ImageView<const uint8_t> bgr, const MaskSums* mask, int first_row);
  /// The next row of windows through colours and orientations; after the last one comes row 0.
  void search_row();
  /// A window that passed these for the object through the rest.
  void decide(size_t object, size_t window);
  /// What decide() will be called for in this image, so that a card may do what it has a twin for at once. In any
  /// order, each at most once.
  void will_decide(std::span<const WindowOfObject> windows);

  /// In the first job, in which what a card allocates is forgiven. `bgr`: no smaller than the scaled image.
  void meet_card(ImageView<const uint8_t> bgr) {
    if (cooccurrence_) cooccurrence_->count_ahead(bgr, {});
  }
  /// The stage of co-occurrences, which has a twin on a card; null without it.
  CooccurrenceStage* cooccurrence() { return cooccurrence_ ? &*cooccurrence_ : nullptr; }

 private:
  std::optional<Shrinker> shrinker_;  ///< none at full size
  SearchGrid grid_;
  double to_image_x_, to_image_y_;
  std::vector<StageLimits> limits_;
  std::vector<size_t> views_;  ///< of each object
  ColourStage colour_;
  std::optional<OrientationStage> orientation_;
  std::optional<CooccurrenceStage> cooccurrence_;
  std::optional<LayoutStage> layout_;
  Decision decision_;
  bool begun_ = false;
  ImageView<const uint8_t> image_;
  std::vector<uint8_t> wanted_;  ///< windows, by the mask
};

}  // namespace takt::object_detection
