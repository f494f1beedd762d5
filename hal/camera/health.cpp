// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/health.hpp"

#include <cstdlib>

#include "rt/msg/image.hpp"

namespace takt {

HealthReading assess_health(ImageView<const uint8_t> image, const HealthThresholds& thresholds,
                            std::span<uint8_t> previous, bool has_previous) {
  HealthReading reading;
  const int step = thresholds.step_px;
  const int channel = image.channels == 3 ? 1 : 0;
  uint64_t sum = 0, gradient = 0, difference = 0, saturated = 0, samples = 0;
  for (int y = 0; y < image.height; y += step) {
    for (int x = 1; x < image.width - 1; x += step) {
      const int level = image.at(x, y, channel);
      sum += static_cast<uint64_t>(level);
      gradient += static_cast<uint64_t>(std::abs(image.at(x + 1, y, channel) - image.at(x - 1, y, channel)));
      saturated += level >= thresholds.saturated_level ? 1 : 0;
      if (samples < previous.size()) {
        difference += static_cast<uint64_t>(std::abs(level - previous[samples]));
        previous[samples] = static_cast<uint8_t>(level);
      }
      ++samples;
    }
  }
  if (samples == 0) return reading;
  const double n = static_cast<double>(samples);
  reading.saturated_fraction = static_cast<double>(saturated) / n;
  reading.mean_level = static_cast<double>(sum) / n;
  reading.mean_gradient = static_cast<double>(gradient) / (2.0 * n);
  reading.mean_difference = has_previous ? static_cast<double>(difference) / n : 0.0;
  if (reading.saturated_fraction > thresholds.saturated_fraction) reading.flags |= image_health::saturated;
  if (reading.mean_level < thresholds.dark_mean) reading.flags |= image_health::dark;
  if (reading.mean_gradient < thresholds.blurred_gradient) reading.flags |= image_health::blurred;
  if (has_previous && reading.mean_difference < thresholds.unchanging_difference) {
    reading.flags |= image_health::unchanging;
  }
  return reading;
}

}  // namespace takt
