// SPDX-License-Identifier: Apache-2.0
// From the bytes of a stereo camera's frame to two images: pure functions (D-3).
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "rt/msg/image_view.hpp"

namespace takt::v4l2 {

/// Where the eyes are in a frame.
enum class FrameFormat : uint8_t {
  y16,   ///< two bytes a pixel, one per eye: a Bumblebee's two sensors in a container of 16 bits
  y8i,   ///< the same under its own name
  rgb3,  ///< three bytes a pixel, one per sensor of a Bumblebee XB3
  yuyv,  ///< a row of one eye beside the row of the other, colours at half resolution
  grey,  ///< a row of one eye beside the row of the other
};
inline constexpr std::string_view kFormatNames[] = {"y16", "y8i", "rgb3", "yuyv", "grey"};
std::optional<FrameFormat> frame_format(std::string_view name);
/// V4L2's code, as a number.
uint32_t four_characters(FrameFormat format);
/// The code as text: "Y16 ".
std::string four_characters_text(uint32_t code);

/// The colours of the pixels (0, 0), (1, 0), (0, 1), (1, 1) of a plane.
enum class Mosaic : uint8_t { none, rggb, grbg, gbrg, bggr };
inline constexpr std::string_view kMosaicNames[] = {"none", "rggb", "grbg", "gbrg", "bggr"};
std::optional<Mosaic> mosaic(std::string_view name);

struct FrameLayout {
  FrameFormat format = FrameFormat::y16;
  int width = 0, height = 0;     ///< of one eye
  int left = 1, right = 0;       ///< which byte of a pixel, or which half of a row, belongs to which eye
  Mosaic mosaic = Mosaic::none;  ///< not none: debayered to BGR; none: a mosaic stays one
  size_t bytes_per_line = 0;     ///< as the device says; at least row_bytes()

  int planes() const { return format == FrameFormat::rgb3 ? 3 : 2; }
  bool side_by_side() const { return format == FrameFormat::yuyv || format == FrameFormat::grey; }
  int channels() const { return format == FrameFormat::yuyv || mosaic != Mosaic::none ? 3 : 1; }
  /// As the device counts its pixels.
  int frame_width() const { return side_by_side() ? 2 * width : width; }
  size_t row_bytes() const;
  size_t image_bytes() const { return bytes_per_line * static_cast<size_t>(height); }
};

/// Moves the eyes of a frame into two images, of one channel, or three (BGR) for yuyv. Returns how many whole rows the
/// frame had; what lies below stays as it was.
int split(std::span<const uint8_t> frame, const FrameLayout& layout, ImageView<uint8_t> left, ImageView<uint8_t> right);

/// The reverse of split(), for images of one channel, or of three (BGR) of which a mosaic keeps one value a pixel.
/// False, and nothing written, for the format yuyv, a frame that is too short, or colours without a mosaic. A third
/// plane and the padding of rows are left as they are.
bool join(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const FrameLayout& layout,
          std::span<uint8_t> frame);

/// A mosaic to BGR, bilinear. Not the kind none; at least 2 x 2 pixels. May allocate.
void debayer(ImageView<const uint8_t> plane, Mosaic mosaic, ImageView<uint8_t> bgr);

}  // namespace takt::v4l2
