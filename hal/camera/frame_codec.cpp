// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/frame_codec.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace takt::v4l2 {
namespace {

template <class Value, size_t N>
std::optional<Value> value_of(const std::string_view (&names)[N], std::string_view name) {
  const auto* found = std::find(std::begin(names), std::end(names), name);
  return found == std::end(names) ? std::nullopt : std::optional(static_cast<Value>(found - std::begin(names)));
}

uint8_t level(int value) { return static_cast<uint8_t>(std::clamp(value, 0, 255)); }

/// ITU-R BT.601, limited range, in 1/256.
void to_bgr(const uint8_t* yuyv, int width, uint8_t* bgr) {
  for (int x = 0; x < width; ++x, bgr += 3) {
    const uint8_t* pair = yuyv + x / 2 * 4;
    const int y = 298 * (pair[x % 2 * 2] - 16) + 128, u = pair[1] - 128, v = pair[3] - 128;
    bgr[0] = level((y + 516 * u) >> 8);
    bgr[1] = level((y - 100 * u - 208 * v) >> 8);
    bgr[2] = level((y + 409 * v) >> 8);
  }
}

void split_row(const uint8_t* row, const FrameLayout& layout, int eye, uint8_t* out) {
  switch (layout.format) {
    case FrameFormat::y16:
    case FrameFormat::y8i:
      for (int x = 0; x < layout.width; ++x) out[x] = row[2 * x + eye];
      return;
    case FrameFormat::rgb3:
      for (int x = 0; x < layout.width; ++x) out[x] = row[3 * x + eye];
      return;
    case FrameFormat::yuyv: return to_bgr(row + ptrdiff_t{2} * layout.width * eye, layout.width, out);
    case FrameFormat::grey: std::copy_n(row + ptrdiff_t{layout.width} * eye, layout.width, out); return;
  }
}

/// Places in BGR of the colours that the pixels (0, 0), (1, 0), (0, 1), (1, 1) of a mosaic see.
constexpr int kColours[][4] = {{0, 0, 0, 0}, {2, 1, 1, 0}, {1, 2, 0, 1}, {1, 0, 2, 1}, {0, 1, 1, 2}};

/// OpenCV names a pattern by the pixels (1, 1) and (2, 1).
int conversion(Mosaic mosaic) {
  switch (mosaic) {
    case Mosaic::rggb: return cv::COLOR_BayerBG2BGR;
    case Mosaic::grbg: return cv::COLOR_BayerGB2BGR;
    case Mosaic::gbrg: return cv::COLOR_BayerGR2BGR;
    default: return cv::COLOR_BayerRG2BGR;
  }
}

}  // namespace

std::optional<FrameFormat> frame_format(std::string_view name) { return value_of<FrameFormat>(kFormatNames, name); }
std::optional<Mosaic> mosaic(std::string_view name) { return value_of<Mosaic>(kMosaicNames, name); }

uint32_t four_characters(FrameFormat format) {
  switch (format) {
    case FrameFormat::y16: return V4L2_PIX_FMT_Y16;
    case FrameFormat::y8i: return V4L2_PIX_FMT_Y8I;
    case FrameFormat::rgb3: return V4L2_PIX_FMT_RGB24;
    case FrameFormat::yuyv: return V4L2_PIX_FMT_YUYV;
    case FrameFormat::grey: return V4L2_PIX_FMT_GREY;
  }
  return 0;
}

std::string four_characters_text(uint32_t code) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(code >> 8 * i & 0x7F);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

size_t FrameLayout::row_bytes() const {
  const int per_pixel = format == FrameFormat::grey ? 1 : format == FrameFormat::rgb3 ? 3 : 2;
  return static_cast<size_t>(frame_width()) * static_cast<size_t>(per_pixel);
}

int split(std::span<const uint8_t> frame, const FrameLayout& layout, ImageView<uint8_t> left,
          ImageView<uint8_t> right) {
  const size_t row_bytes = layout.row_bytes();
  int rows = 0;
  for (; rows < layout.height; ++rows) {
    const size_t begin = static_cast<size_t>(rows) * layout.bytes_per_line;
    if (begin + row_bytes > frame.size()) break;
    split_row(frame.data() + begin, layout, layout.left, left.row(rows));
    split_row(frame.data() + begin, layout, layout.right, right.row(rows));
  }
  return rows;
}

bool join(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const FrameLayout& layout,
          std::span<uint8_t> frame) {
  const bool colours = left.channels == 3;
  if (layout.format == FrameFormat::yuyv || frame.size() < layout.image_bytes() ||
      colours != (layout.mosaic != Mosaic::none))
    return false;
  const auto& sees = kColours[static_cast<size_t>(layout.mosaic)];
  const int apart = layout.side_by_side() ? 1 : layout.planes();
  for (int y = 0; y < layout.height; ++y) {
    uint8_t* row = frame.data() + static_cast<size_t>(y) * layout.bytes_per_line;
    for (const auto& [image, eye] : {std::pair{&left, layout.left}, std::pair{&right, layout.right}}) {
      uint8_t* out = row + (layout.side_by_side() ? ptrdiff_t{layout.width} * eye : ptrdiff_t{eye});
      const uint8_t* in = image->row(y);
      for (int x = 0; x < layout.width; ++x) out[x * apart] = colours ? in[3 * x + sees[y % 2 * 2 + x % 2]] : in[x];
    }
  }
  return true;
}

void debayer(ImageView<const uint8_t> plane, Mosaic mosaic, ImageView<uint8_t> bgr) {
  const cv::Mat from(plane.height, plane.width, CV_8UC1, const_cast<uint8_t*>(plane.data),
                     static_cast<size_t>(plane.stride));
  cv::Mat to(bgr.height, bgr.width, CV_8UC3, bgr.data, static_cast<size_t>(bgr.stride));
  cv::cvtColor(from, to, conversion(mosaic));
}

}  // namespace takt::v4l2
