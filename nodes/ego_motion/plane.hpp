// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::ego_motion {

/// A grey image that owns its memory. Rows may be read 32 bytes past their end (vector loads of patch rows).
class Plane {
 public:
  static constexpr int kPadding = 32;
  Plane() = default;
  Plane(int width, int height)
      : width_(width),
        height_(height),
        stride_((width + kPadding + 63) / 64 * 64),
        pixels_(static_cast<size_t>(stride_) * static_cast<size_t>(height) + 64) {}

  int width() const { return width_; }
  int height() const { return height_; }
  ptrdiff_t stride() const { return stride_; }
  uint8_t* row(int y) { return pixels_.data() + stride_ * y; }
  const uint8_t* row(int y) const { return pixels_.data() + stride_ * y; }
  ImageView<const uint8_t> view() const { return {pixels_.data(), width_, height_, 1, stride_}; }
  void swap(Plane& other) noexcept {
    std::swap(width_, other.width_), std::swap(height_, other.height_), std::swap(stride_, other.stride_);
    pixels_.swap(other.pixels_);
  }

 private:
  int width_ = 0, height_ = 0;
  ptrdiff_t stride_ = 0;
  std::vector<uint8_t> pixels_;
};

/// Grey of an 8-bit image with 1 or 3 (BGR) channels: (29 B + 150 G + 77 R + 128) / 256. Sizes must agree.
void to_grey(ImageView<const uint8_t> image, Plane& out);
/// Half the size, each pixel the rounded mean of 2 x 2; an odd last row or column is left out.
void halve(const Plane& in, Plane& out);

/// Level 0 is the image itself; each next level is half as large.
class Pyramid {
 public:
  Pyramid() = default;
  Pyramid(int width, int height, int levels);
  void build(ImageView<const uint8_t> image);
  int levels() const { return static_cast<int>(levels_.size()); }
  const Plane& level(int l) const { return levels_[static_cast<size_t>(l)]; }
  void swap(Pyramid& other) noexcept { levels_.swap(other.levels_); }

 private:
  std::vector<Plane> levels_;
};

}  // namespace takt::ego_motion
