// SPDX-License-Identifier: Apache-2.0
#include "rt/record/jpeg_compressor.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <utility>

namespace takt::record {

JpegCompressor::JpegCompressor(JpegCompressor&& other) noexcept
    : quality_(other.quality_),
      compressor_(std::exchange(other.compressor_, nullptr)),
      buffer_(std::exchange(other.buffer_, nullptr)),
      room_(other.room_) {}

JpegCompressor::~JpegCompressor() {
  if (compressor_ != nullptr) tjDestroy(compressor_);
  if (buffer_ != nullptr) tjFree(buffer_);
}

std::span<const uint8_t> JpegCompressor::compress(const ImageView<const uint8_t>& picture) {
  const auto [data, width, height, channels, stride] = picture;
  if (std::min(width, height) <= 0 || std::max(width, height) > kLargestJpeg || (channels != 1 && channels != 3))
    return {};
  if (compressor_ == nullptr) compressor_ = tjInitCompress();
  const int sampling = channels == 1 ? TJSAMP_GRAY : quality_ < 90 ? TJSAMP_420 : TJSAMP_444;
  unsigned long bytes = room_;
  if (compressor_ == nullptr ||
      tjCompress2(compressor_, data, width, static_cast<int>(stride), height, channels == 1 ? TJPF_GRAY : TJPF_BGR,
                  &buffer_, &bytes, sampling, quality_, 0) != 0)
    return {};
  room_ = std::max(room_, bytes);
  return {buffer_, bytes};
}

}  // namespace takt::record
