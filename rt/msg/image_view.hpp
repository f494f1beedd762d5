// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/image_view.hpp>: core, stable.
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt {

/// A non-owning window on an image: row-major, `channels` interleaved elements per pixel, `stride` elements from one
/// row to the next. Pixel (x, y): x grows to the right, y downwards.
template <class T>
struct ImageView {
  T* data = nullptr;
  int width = 0;
  int height = 0;
  int channels = 1;
  ptrdiff_t stride = 0;

  ImageView() = default;
  ImageView(T* data_, int width_, int height_, int channels_ = 1)
      : data(data_), width(width_), height(height_), channels(channels_), stride(ptrdiff_t{width_} * channels_) {}
  ImageView(T* data_, int width_, int height_, int channels_, ptrdiff_t stride_)
      : data(data_), width(width_), height(height_), channels(channels_), stride(stride_) {}

  T* row(int y) const { return data + y * stride; }
  T& at(int x, int y, int channel = 0) const { return row(y)[ptrdiff_t{x} * channels + channel]; }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  operator ImageView<const T>() const { return {data, width, height, channels, stride}; }
};

/// Whether an image of that size stays within so many elements.
constexpr bool image_fits(int64_t width, int64_t height, int64_t channels, uint64_t elements) {
  return width >= 0 && height >= 0 && channels >= 0 &&
         static_cast<uint64_t>(width) * static_cast<uint64_t>(height) <= elements &&
         static_cast<uint64_t>(width) * static_cast<uint64_t>(height) * static_cast<uint64_t>(channels) <= elements;
}

}  // namespace takt
