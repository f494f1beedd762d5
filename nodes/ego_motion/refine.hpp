// SPDX-License-Identifier: Apache-2.0
// Sub-pixel position of a patch: inverse compositional Lucas-Kanade for a pure shift. Brightness offsets between the
// two images cancel because the gradients have their mean removed. More accurate than a parabola through SAD costs,
// which is drawn towards whole pixels.
#pragma once
#include "nodes/ego_motion/plane.hpp"

namespace takt::ego_motion {

struct SubPixel {
  double x = 0, y = 0;
  bool converged = false;
};

class RefinePatch {
 public:
  /// Takes the patch of (2 half + 1)^2 samples centred on (x, y), bilinear; half <= 7. False (and unusable) if it or
  /// its gradient leaves the image.
  bool take(const Plane& image, double x, double y, int half);
  /// Position near (x, y) in `image` that looks like the patch. Not converged: the patch has too little texture, left
  /// the image or moved by more than `limit_px` from the start.
  SubPixel refine(const Plane& image, double x, double y, double limit_px) const;
  /// The same along the row only (rectified stereo).
  SubPixel refine_in_row(const Plane& image, double x, double y, double limit_px) const;

 private:
  static constexpr int kRow = 16;
  struct Sums {
    float x = 0, y = 0;
  };
  bool sums(const Plane& image, double x, double y, Sums& out) const;

  int half_ = 0;
  // Gradients are zero beyond the patch, so that sums need no tail.
  float value_[15][kRow], gx_[15][kRow], gy_[15][kRow];
  float xx_ = 0, xy_ = 0, yy_ = 0;
};

}  // namespace takt::ego_motion
