// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>

#include "rt/msg/image_view.hpp"

namespace takt {

/// Thresholds of the health flags. Fractions are of the sampled pixels, levels 0..255.
struct HealthThresholds {
  int step_px = 8;                      ///< one pixel in step_px x step_px is looked at
  int saturated_level = 250;            ///< a pixel at or above is saturated ...
  double saturated_fraction = 0.05;     ///< ... and more than this makes the frame saturated (R-15.4)
  double dark_mean = 20.0;              ///< mean level below which the frame is dark
  double blurred_gradient = 1.5;        ///< mean |I(x+1) - I(x-1)| / 2 below which the frame is blurred or featureless
  double unchanging_difference = 0.25;  ///< mean |I - previous I| below which the frame repeats (a sensor adds noise)
};

/// What was measured, and the flags that follow; bits of takt::image_health.
struct HealthReading {
  double saturated_fraction = 0, mean_level = 0, mean_gradient = 0;
  double mean_difference = 0;  ///< to the previous frame; 0 without one
  uint32_t flags = 0;
};

/// Samples that `assess_health` keeps of an image of that size.
inline int health_samples(int width, int height, int step_px) {
  return width < 3 || step_px < 1 ? 0 : ((width - 2 + step_px - 1) / step_px) * ((height + step_px - 1) / step_px);
}

/// Looks at a subsampled image (8 bit, 1 or 3 channels; of three the middle one, green) at capture. `previous` holds
/// the samples of the frame before and is overwritten with this frame's (health_samples(...) bytes); has_previous =
/// false: unchanging is not judged. Pure: same input, same reading; no allocation; about 5,000 samples of a 640 x 480
/// image.
HealthReading assess_health(ImageView<const uint8_t> image, const HealthThresholds& thresholds,
                            std::span<uint8_t> previous, bool has_previous);

}  // namespace takt
