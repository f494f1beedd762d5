// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/object_detection/colour_stage.hpp"
#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/object_detection/orientation_stage.hpp"
#include "nodes/object_detection/references.hpp"

namespace takt::object_detection {

/// One stage by itself for one object: the error map of Eq. 3.18, for measurements.
class StageErrors {
 public:
  /// `views`: histograms of the stage.
  StageErrors(Stage stage, const SearchGrid& grid, const std::vector<Histogram>& views, const DetectorParameters& p);

  /// Of each window the smallest error of the views, 0..1. `bgr`: three channels, of the grid's image size.
  std::vector<float> run(ImageView<const uint8_t> bgr);

 private:
  template <class Mass>
  float least(std::span<const Mass> missing) const;

  SearchGrid grid_;
  std::vector<uint32_t> masses_;
  std::optional<ColourStage> colour_;
  std::optional<OrientationStage> orientation_;
  std::optional<CooccurrenceStage> cooccurrence_;
};

}  // namespace takt::object_detection
