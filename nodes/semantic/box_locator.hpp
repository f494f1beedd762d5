// SPDX-License-Identifier: Apache-2.0
// From a box in the image to a place before the camera.
#pragma once
#include <optional>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::semantic {

struct BoxLocatorParameters {
  double share = 0.6;      ///< of the box in each direction, about its middle: what is behind shows at its edges
  double valid_min = 0.2;  ///< of the pixels there must have a disparity
  double agree = 0;        ///< of those with one: so many near one depth make it the object's; 0: the median of all
};

/// A disparity map as the stereo node publishes it; `fraction` may be without data: whole pixels only.
struct DisparityView {
  ImageView<const int16_t> disparity;
  ImageView<const uint8_t> fraction;
  CameraModel camera;
};

/// Memory is taken by the constructor. One thread at a time.
class BoxLocator {
 public:
  /// For disparity maps of at most so many pixels.
  BoxLocator(size_t most_pixels, const BoxLocatorParameters& parameters);
  void tune(const BoxLocatorParameters& parameters) { parameters_ = parameters; }

  /// Z = f B / d with the median of the disparities, X and Y through the middle of the box; camera frame x right, y
  /// down, z forward. With `agree` the median of the nearest ones within 6 % of each other that are so many: a box that
  /// shows more of what is behind, or of wrong disparities, than of the object still has its depth. None: too few
  /// pixels have a disparity, or it is 0. Stamps of box and map are the caller's to compare. Boxes may reach beyond the
  /// image.
  std::optional<mapping_3d::Position> locate(double x_px, double y_px, double width_px, double height_px,
                                             const DisparityView& map);

 private:
  int32_t object_disparity();

  BoxLocatorParameters parameters_;
  std::vector<int32_t> disparities_;  ///< 1/64 px
};

}  // namespace takt::semantic
