// SPDX-License-Identifier: Apache-2.0
// Last stage of the cascade, beyond the thesis's three: are colours and lines where the object has them?
#pragma once
#include <algorithm>
#include <vector>

#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/layout.hpp"

namespace takt::object_detection {

/// What tells a view from its surroundings: a weight for each feature. If both are normally distributed with one
/// covariance, the logarithm of how much likelier a square's features are where the view is than where it is not is
/// unit (weighted sum of the features - middle).
struct LayoutTemplate {
  std::array<int16_t, kLayoutFeatures> weight{};
  int32_t middle = 0;
  float unit = 1;

  float evidence(const LayoutFeatures& features) const;
};
/// Error of a square with that evidence, 0 .. 1: common to all objects, so that they can be compared; half where the
/// evidence is kLayoutEvidence, 1 where there is none. An image of 640 x 480 has some 75,000 squares times 60 views of
/// ten objects, and e^20 is hundred times as many: one false alarm in hundred images if surroundings were normally
/// distributed.
constexpr float kLayoutEvidence = 20;
constexpr double kLayoutThreshold = 0.5;  ///< of the error, unless the database says otherwise
inline float layout_error(float evidence) { return kLayoutEvidence / (kLayoutEvidence + std::max(0.0f, evidence)); }
/// Largest magnitude of a weight: kLayoutFeatures products with features stay below 2^31.
constexpr int kLargestLayoutWeight = 2047;

/// Per object the templates of its views and the error below which a window passes.
struct LayoutObject {
  std::vector<LayoutTemplate> views;
  double threshold = 0;
};

/// Looks where in and around a window a view fits best: at kSides sizes, with its middle up to half of the windows'
/// pitch away from the window's, in quarters of the pitch; what would reach beyond the image is moved into it. Memory
/// is taken by the constructor. One thread at a time.
class LayoutStage {
 public:
  static constexpr std::array<double, 3> kSides = {0.8, 1, 1.25};  ///< of the views' edge

  /// `reference_px`: edge of the views. Throws std::invalid_argument if the largest square does not fit the image.
  LayoutStage(const SearchGrid& grid, int reference_px, std::vector<LayoutObject> objects);

  struct Fit {
    float error = 1;
    Placement at;
  };
  /// The least error of the object's views around a window of the image, and where; of equals the first, by size, row,
  /// column, view. `bgr`: three channels, of the grid's image size (not checked).
  Fit best(ImageView<const uint8_t> bgr, size_t window, size_t object);
  bool passes(size_t object, const Fit& fit) const { return fit.error < objects_[object].threshold; }

  /// All squares that best() tries around a window.
  std::vector<Placement> placements(size_t window) const;

 private:
  static constexpr int kSteps = 2;  ///< to each side
  template <class Act>
  void for_each_placement(size_t window, const Act& act) const;

  SearchGrid grid_;
  std::array<int, kSides.size()> sides_{};
  int step_px_;
  std::vector<LayoutObject> objects_;
  LayoutSums sums_;
  LayoutFeatures features_{};
};

}  // namespace takt::object_detection
