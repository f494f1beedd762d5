// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/photographs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

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

/// 1 where the object is, else 0.
cv::Mat1f object_mask(const cv::Mat3b& image) {
  const cv::Scalar median(border_median(image)), reach = cv::Scalar::all(kLikeBackground);
  cv::Mat1b alike;
  cv::inRange(image, median - reach, median + reach, alike);
  cv::copyMakeBorder(alike, alike, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);  // so that the border hangs together
  constexpr int kBackground = 128;
  cv::floodFill(alike, {0, 0}, kBackground);
  cv::Mat1b object;
  cv::compare(alike(cv::Rect(1, 1, image.cols, image.rows)), kBackground, object, cv::CMP_NE);
  cv::Mat1f mask;
  object.convertTo(mask, CV_32F, 1.0 / 255);
  return mask;
}

}  // namespace

ReferenceView cut_out(const std::filesystem::path& file, int side_px) {
  const cv::Mat3b image = cv::imread(file.string(), cv::IMREAD_COLOR);
  if (image.empty()) throw std::runtime_error(file.string() + " cannot be read or is no image");
  cv::Mat1f mask = object_mask(image);
  cv::Mat3f colours;
  image.convertTo(colours, CV_32FC3);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) colours(y, x) *= mask(y, x);
  // Apart and divided, so that the background does not tint the rim.
  cv::resize(colours, colours, {side_px, side_px}, 0, 0, cv::INTER_AREA);
  cv::resize(mask, mask, {side_px, side_px}, 0, 0, cv::INTER_AREA);
  ReferenceView view;
  view.file = file;
  view.side_px = side_px;
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x)
      for (int c = 0; c < 3; ++c)
        view.pixels.push_back(
            mask(y, x) > 0.5f ? static_cast<uint8_t>(std::clamp(std::lround(colours(y, x)[c] / mask(y, x)), 1l, 255l))
                              : uint8_t{0});
  return view;
}

std::vector<DatabaseObject> read_turntable(const std::filesystem::path& folder, int side_px) {
  std::map<std::pair<int, int>, std::filesystem::path> files;  // by number and angle
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    int number = 0, angle = 0;
    if (std::sscanf(entry.path().filename().c_str(), "obj%d__%d.png", &number, &angle) == 2)
      files[{number, angle}] = entry.path();
  }
  std::vector<DatabaseObject> objects;
  for (const auto& [key, file] : files) {
    const std::string name = "obj" + std::to_string(key.first);
    if (objects.empty() || objects.back().name != name) objects.emplace_back().name = name;
    (key.second % 60 == 0 ? objects.back().views : objects.back().test_views).push_back(cut_out(file, side_px));
  }
  return objects;
}

}  // namespace takt::object_detection
