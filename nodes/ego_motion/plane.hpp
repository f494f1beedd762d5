// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::ego_motion {

/// A grey image that owns its memory. kPadding bytes past the end of a row may be read and written (vectors).
class Plane {
 public:
  static constexpr int kPadding = 64;
  Plane() = default;
  Plane(int width, int height)
      : width_(width),
        height_(height),
        stride_((width + kPadding + 63) / 64 * 64),
        pixels_(static_cast<size_t>(stride_) * static_cast<size_t>(height) + kPadding) {}

  int width() const { return width_; }
  int height() const { return height_; }
  ptrdiff_t stride() const { return stride_; }
  uint8_t* row(int y) { return pixels_.data() + stride_ * y; }
  const uint8_t* row(int y) const { return pixels_.data() + stride_ * y; }
  ImageView<const uint8_t> view() const { return {pixels_.data(), width_, height_, 1, stride_}; }
  /// Without the padding.
  void remember(StateArchive& archive) {
    for (int y = 0; y < height_; ++y) archive.raw(row(y), static_cast<size_t>(width_));
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

/// An image and how bright it is around each pixel, so that blocks of two images can be compared whose exposure
/// differs.
class Level {
 public:
  static constexpr int kWindow = 8;  ///< edge of the square that `mean` is taken of

  Level() = default;
  Level(int width, int height)
      : image(width, height), mean(width, height), sums_(static_cast<size_t>(width + Plane::kPadding)) {}
  /// Both sides must be at least kWindow.
  void fill_mean();

  Plane image;
  /// Rounded mean of columns x - 4 .. x + 3 and rows y - 4 .. y + 3; where that leaves the image, of the nearest square
  /// that does not. All zero if nobody asked for it: then a comparison is one of grey values.
  Plane mean;

 private:
  std::vector<uint16_t> sums_;  // of columns
};

/// Level 0 is the image itself; each next level is half as large.
class Pyramid {
 public:
  Pyramid() = default;
  Pyramid(int width, int height, int levels);
  /// Makes all levels of an image; their means as well if asked.
  void build(ImageView<const uint8_t> image, bool means);
  int levels() const { return static_cast<int>(levels_.size()); }
  const Level& level(int l) const { return levels_[static_cast<size_t>(l)]; }
  void swap(Pyramid& other) noexcept { levels_.swap(other.levels_); }
  /// The image of the first level, from which all others are made.
  Plane& image() { return levels_.front().image; }

 private:
  std::vector<Level> levels_;
};

}  // namespace takt::ego_motion
