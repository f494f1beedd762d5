// SPDX-License-Identifier: Apache-2.0
// Thresholds from images with and without an object (R-6.8: "per object and stage, by experiment").
#pragma once
#include <array>
#include <span>
#include <vector>

#include "nodes/object_detection/references.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// Smallest error of an object's views in each window of an image (map m_o of Eq. 3.18), stage by stage.
struct ErrorMaps {
  SearchGrid grid;
  std::array<std::vector<float>, kHistogramStages> error;
};
/// All stages of every window, whatever passed. `bgr`: three channels; `references`: of all stages. Throws
/// std::invalid_argument if the windows do not fit.
ErrorMaps error_maps(ImageView<const uint8_t> bgr, const CascadeReferences& references, size_t object, int reference_px,
                     const DetectorParameters& p);

/// Shares of images at one threshold of the last stage.
struct RocPoint {
  double threshold = 0, detected = 0, false_positive = 0;
};

struct Tuning {
  std::array<double, kHistogramStages> thresholds{};
  std::vector<RocPoint> roc;  ///< by threshold, from nothing passes to all that the first two stages let through
  RocPoint chosen;
};

/// `with`: maps of images that show the object somewhere, at least one; `without`: of images that do not. Where it is
/// in an image is taken to be the window with the least sum of its errors. The thresholds of the first two
/// stages lie a tenth above what all but a share `miss` of these windows have; that of the last stage is where
/// `detected` exceeds `false_positive` by most, in the middle of all thresholds that are equal in that.
Tuning tune(std::span<const ErrorMaps> with, std::span<const ErrorMaps> without, double miss);

}  // namespace takt::object_detection
