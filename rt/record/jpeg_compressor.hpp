// SPDX-License-Identifier: Apache-2.0
// Pictures as JPEG, by libjpeg-turbo.
//
//   JpegCompressor compressor(75);
//   if (auto jpeg = compressor.compress(image.view()); !jpeg.empty()) write(jpeg);
#pragma once
#include <cstdint>
#include <span>

#include "rt/msg/image_view.hpp"

namespace takt::record {

constexpr int kLargestJpeg = 65'500;  ///< width and height, px

/// Keeps its buffer from picture to picture. One thread at a time.
class JpegCompressor {
 public:
  /// `quality`: 1 to 100; colours have half the resolution below 90.
  explicit JpegCompressor(int quality) : quality_(quality) {}
  ~JpegCompressor();
  JpegCompressor(JpegCompressor&& other) noexcept;
  JpegCompressor& operator=(JpegCompressor&&) = delete;

  /// Grey of one channel, BGR of three. Valid until the next call. Empty: the picture has no pixels, other channels or
  /// too many columns or rows, or there is no memory.
  std::span<const uint8_t> compress(const ImageView<const uint8_t>& picture);

 private:
  int quality_;
  void* compressor_ = nullptr;       ///< of libjpeg-turbo, made with the first picture
  unsigned char* buffer_ = nullptr;  ///< its own
  unsigned long room_ = 0;
};

}  // namespace takt::record
