// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// Images of one size at a smaller scale, by linear interpolation between pixel centres: bit for bit what cv::resize
/// makes with INTER_LINEAR_EXACT. From half the size on every pixel of the image counts. Memory is taken by the
/// constructor. One thread at a time.
class Shrinker {
 public:
  /// To round(scale * width) x round(scale * height); `scale` 0.5 .. 1.
  Shrinker(int width, int height, double scale);

  int width() const { return static_cast<int>(columns_.size()); }
  int height() const { return static_cast<int>(rows_.size()); }
  /// `bgr`: three channels, of the constructor's size (not checked). Valid until the next call.
  ImageView<const uint8_t> run(ImageView<const uint8_t> bgr);

 private:
  /// Between two neighbours; `share` of the second, 1/256.
  struct Tap {
    int first, second;
    uint32_t share;
  };
  static std::vector<Tap> taps(int from, double scale);

  std::vector<Tap> columns_, rows_;
  std::vector<uint16_t> row_;  ///< between two rows of the image, 1/256
  std::vector<uint8_t> pixels_;
};

}  // namespace takt::object_detection
