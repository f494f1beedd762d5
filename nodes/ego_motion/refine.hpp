// SPDX-License-Identifier: Apache-2.0
// Sub-pixel position of a patch: inverse compositional Lucas-Kanade for a pure shift (Baker, Matthews, "Lucas-Kanade 20
// years on", 2004). The gradients are made orthogonal to the patch and to a constant, so that neither gain nor offset
// of the brightness moves the result ("project out", ibid. part 3). More accurate than a parabola through SAD costs,
// which is drawn towards whole pixels.
#pragma once
#include "nodes/ego_motion/plane.hpp"

namespace takt::ego_motion {

struct SubPixel {
  double x = 0, y = 0;
  bool converged = false;
};

struct RefineKernels;
const RefineKernels& refine_kernels();     ///< of the best SIMD target of this machine
const RefineKernels& refine_references();  ///< slow and obvious: loops over single pixels; the same bits

class RefinePatch {
 public:
  static constexpr int kMaximumHalf = 7;
  static constexpr int kRow = 16;  ///< columns of the arrays below; those beyond the patch hold zeros

  /// The patch as the kernels see it.
  struct Samples {
    int half = 0;
    alignas(64) float value[2 * kMaximumHalf + 1][kRow];                               ///< less their mean
    alignas(64) float gx[2 * kMaximumHalf + 1][kRow], gy[2 * kMaximumHalf + 1][kRow];  ///< orthogonal to value and to 1
    float square = 0;                                                                  ///< sum of value^2
    float xx = 0, xy = 0, yy = 0;  ///< sums of products of gx and gy
  };

  explicit RefinePatch(const RefineKernels& kernels = refine_kernels()) : kernels_(kernels) {}
  /// Takes the patch of (2 half + 1)^2 samples centred on (x, y), bilinear; half <= 7. False (and unusable) if it or
  /// its gradient leaves the image.
  bool take(const Plane& image, double x, double y, int half);
  /// Position near (x, y) in `image` that looks like the patch. Not converged: the patch has too little texture, left
  /// the image, moved by more than `limit_px` from the start, or is not to be seen there with half to twice its
  /// contrast.
  SubPixel refine(const Plane& image, double x, double y, double limit_px) const;
  /// The same along the row only (rectified stereo).
  SubPixel refine_in_row(const Plane& image, double x, double y, double limit_px) const;
  const Samples& samples() const { return samples_; }

 private:
  const RefineKernels& kernels_;
  Samples samples_;
};

}  // namespace takt::ego_motion
