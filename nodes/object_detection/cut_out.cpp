// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/cut_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "nodes/picture/image_file.hpp"
#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"

namespace takt::object_detection {
namespace {

constexpr int kLikeBackground = 30;

cv::Vec3b border_median(const cv::Mat3b& image) {
  std::array<std::vector<uint8_t>, 3> of_border;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (x == 0 || y == 0 || x == image.cols - 1 || y == image.rows - 1)
        for (int c = 0; c < 3; ++c) of_border[static_cast<size_t>(c)].push_back(image(y, x)[c]);
  cv::Vec3b median;
  for (int c = 0; c < 3; ++c) {
    auto& values = of_border[static_cast<size_t>(c)];
    std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
    median[c] = values[values.size() / 2];
  }
  return median;
}

/// Not 0 where the object is.
cv::Mat1b before_plain_background(const cv::Mat3b& image) {
  const cv::Scalar median(border_median(image)), reach = cv::Scalar::all(kLikeBackground);
  cv::Mat1b alike;
  cv::inRange(image, median - reach, median + reach, alike);
  cv::copyMakeBorder(alike, alike, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);  // so that the border hangs together
  constexpr int kBackground = 128;
  cv::floodFill(alike, {0, 0}, kBackground);
  cv::Mat1b object;
  cv::compare(alike(cv::Rect(1, 1, image.cols, image.rows)), kBackground, object, cv::CMP_NE);
  return object;
}

/// Pixels under the mask at another size, on black. Colours and mask are scaled apart and divided, so that the
/// background does not tint the rim.
ReferenceView scaled_view(const cv::Mat3b& image, const cv::Mat1b& object, int side_px) {
  cv::Mat1f mask;
  object.convertTo(mask, CV_32F, 1.0 / 255);
  cv::Mat3f colours;
  image.convertTo(colours, CV_32FC3);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) colours(y, x) *= mask(y, x);
  const int method = side_px < image.cols ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(colours, colours, {side_px, side_px}, 0, 0, method);
  cv::resize(mask, mask, {side_px, side_px}, 0, 0, method);
  ReferenceView view;
  view.side_px = side_px;
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x)
      for (int c = 0; c < 3; ++c)
        view.pixels.push_back(
            mask(y, x) > 0.5f ? static_cast<uint8_t>(std::clamp(std::lround(colours(y, x)[c] / mask(y, x)), 1l, 255l))
                              : uint8_t{0});
  return view;
}

/// Square with the object's box in its middle, which may reach beyond the image.
cv::Rect square_around(const cv::Mat1b& object) {
  const cv::Rect box = cv::boundingRect(object);
  const int side = std::max(box.width, box.height);
  return {box.x - (side - box.width) / 2, box.y - (side - box.height) / 2, side, side};
}

/// That part of an image, 0 beyond its border.
cv::Mat part(const cv::Mat& image, const cv::Rect& wanted) {
  cv::Mat padded = cv::Mat::zeros(wanted.size(), image.type());
  const cv::Rect inside = wanted & cv::Rect(0, 0, image.cols, image.rows);
  image(inside).copyTo(padded(inside - wanted.tl()));
  return padded;
}

}  // namespace

ReferenceView cut_out(const std::filesystem::path& file, int side_px) {
  const cv::Mat3b image = read_image(file, Channels::colour);
  ReferenceView view = scaled_view(image, before_plain_background(image), side_px);
  view.file = file;
  return view;
}

ReferenceView learn_view(const std::filesystem::path& file, int side_px) {
  const cv::Mat read = read_values(file);
  if (read.depth() != CV_8U || (read.channels() != 3 && read.channels() != 4))
    throw std::runtime_error(file.string() + " must have three channels of 8 bit, or four: colour and transparency");
  cv::Mat3b image;
  cv::Mat1b object;
  if (read.channels() == 4) {
    cv::extractChannel(read, object, 3);
    cv::cvtColor(read, image, cv::COLOR_BGRA2BGR);
    object = object >= 128;
  } else {
    image = read;
    const bool on_black = border_median(image) == cv::Vec3b(0, 0, 0);
    if (on_black) cv::inRange(image, cv::Scalar::all(0), cv::Scalar::all(0), object);
    object = on_black ? cv::Mat1b(~object) : before_plain_background(image);
    if (on_black && image.size() == cv::Size(side_px, side_px) && cv::countNonZero(object) > 0)
      return {file, side_px, {image.datastart, image.dataend}, {}};
  }
  const int pixels = cv::countNonZero(object);
  if (pixels == 0 || pixels == image.rows * image.cols)
    throw std::runtime_error(file.string() + (pixels == 0 ? " shows no object" : " has no background") +
                             "; cut the object out: on exactly (0, 0, 0), by transparency or before one colour");
  const cv::Rect square = square_around(object);
  ReferenceView view = scaled_view(part(image, square), part(object, square), side_px);
  view.file = file;
  return view;
}

void write_view(const ReferenceView& view, const std::filesystem::path& file) {
  const cv::Mat image(view.side_px, view.side_px, CV_8UC3, const_cast<uint8_t*>(view.pixels.data()));
  require_written(picture::write_image(file, image));
}

}  // namespace takt::object_detection
