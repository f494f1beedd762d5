// SPDX-License-Identifier: Apache-2.0
// Any frame, of any layout that the driver lets through, to the codec of the stereo cameras, against its definition.
#include <algorithm>
#include <cstring>
#include <vector>

#include "hal/camera/frame_codec.hpp"
#include "tests/fuzz/require.hpp"

using namespace takt;
using namespace takt::v4l2;
using takt::fuzz::require;

namespace {

constexpr uint8_t kUntouched = 0xA5;

struct Images {
  std::vector<uint8_t> left_pixels, right_pixels;
  ImageView<uint8_t> left, right;
  Images(int width, int height, int channels)
      : left_pixels(static_cast<size_t>(width * height * channels), kUntouched),
        right_pixels(left_pixels),
        left(left_pixels.data(), width, height, channels),
        right(right_pixels.data(), width, height, channels) {}
  bool operator==(const Images& other) const {
    return left_pixels == other.left_pixels && right_pixels == other.right_pixels;
  }
};

/// Where the byte of a pixel of an eye stands in its row, of formats of one byte a pixel and eye.
size_t place(const FrameLayout& layout, int eye, int x) {
  if (layout.format == FrameFormat::grey) return static_cast<size_t>(eye * layout.width + x);
  return static_cast<size_t>(layout.planes() * x + eye);
}

void check_grey(std::span<const uint8_t> frame, const FrameLayout& layout, int rows, const Images& seen) {
  for (int y = 0; y < layout.height; ++y)
    for (int x = 0; x < layout.width; ++x) {
      const uint8_t* row = frame.data() + static_cast<size_t>(y) * layout.bytes_per_line;
      require(seen.left.at(x, y) == (y < rows ? row[place(layout, layout.left, x)] : kUntouched));
      require(seen.right.at(x, y) == (y < rows ? row[place(layout, layout.right, x)] : kUntouched));
    }
}

/// What is put together again and taken apart once more is the same.
void check_join(const FrameLayout& layout, const Images& seen) {
  std::vector<uint8_t> frame(layout.image_bytes() + 1, 0);
  require(!join(seen.left, seen.right, layout, std::span(frame).first(layout.image_bytes() - 1)));
  require(join(seen.left, seen.right, layout, std::span(frame).first(layout.image_bytes())));
  Images again(layout.width, layout.height, 1);
  require(split(frame, layout, again.left, again.right) == layout.height && again == seen);
}

}  // namespace

/// Format, size, which eye is where, mosaic, padding of a row; then the frame.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr size_t kHead = 6;
  if (size < kHead) return 0;
  FrameLayout layout;
  layout.format = static_cast<FrameFormat>(data[0] % 5);
  layout.width = 2 + data[1] % 40 * (layout.format == FrameFormat::yuyv ? 2 : 1);
  layout.height = 2 + data[2] % 20;
  layout.left = data[3] % layout.planes();
  layout.right = (layout.left + 1 + data[3] / 16 % (layout.planes() - 1)) % layout.planes();
  layout.bytes_per_line = layout.row_bytes() + data[5] % 8;
  const std::span<const uint8_t> frame(data + kHead, size - kHead);
  const int channels = layout.channels();  // before debayering
  Images seen(layout.width, layout.height, channels);
  const int rows = split(frame, layout, seen.left, seen.right);
  require(rows >= 0 && rows <= layout.height);
  require(rows == layout.height ||
          static_cast<size_t>(rows) * layout.bytes_per_line + layout.row_bytes() > frame.size());
  if (channels == 1) {
    check_grey(frame, layout, rows, seen);
    check_join(layout, seen);
    const auto pattern = static_cast<Mosaic>(data[4] % 5);
    if (pattern != Mosaic::none && layout.width > 2 && layout.height > 2) {  // OpenCV leaves smaller ones black
      Images bgr(layout.width, layout.height, 3);
      debayer(seen.left, pattern, bgr.left);
      // A colour is between the least and the most of the mosaic.
      const auto [low, high] = std::minmax_element(seen.left_pixels.begin(), seen.left_pixels.end());
      for (const uint8_t value : bgr.left_pixels) require(value >= *low && value <= *high);
    }
  } else {
    std::vector<uint8_t> none(layout.image_bytes());
    require(!join(seen.left, seen.right, layout, none));
  }
  if (size >= kHead + 4) {
    uint32_t code;
    std::memcpy(&code, data + kHead, sizeof(code));
    require(four_characters_text(code).size() == 4);
  }
  return 0;
}
