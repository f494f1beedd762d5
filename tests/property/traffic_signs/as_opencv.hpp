// SPDX-License-Identifier: Apache-2.0
// What a cascade finds in an image, against OpenCV.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <tuple>
#include <vector>

#include "nodes/traffic_signs/search.hpp"

namespace takt::test {

using namespace traffic_signs;

inline ImageView<const uint8_t> view(const cv::Mat1b& image) { return {image.data, image.cols, image.rows}; }

inline auto key(const Box& b) { return std::tuple(b.x, b.y, b.width, b.height); }

inline std::vector<std::tuple<int, int, int, int>> sorted(const std::vector<Box>& boxes) {
  std::vector<std::tuple<int, int, int, int>> keys;
  for (const Box& box : boxes) keys.push_back(key(box));
  std::sort(keys.begin(), keys.end());
  return keys;
}

inline std::vector<std::tuple<int, int, int, int>> sorted(const std::vector<cv::Rect>& boxes) {
  std::vector<std::tuple<int, int, int, int>> keys;
  for (const cv::Rect& b : boxes) keys.emplace_back(b.x, b.y, b.width, b.height);
  std::sort(keys.begin(), keys.end());
  return keys;
}

/// What ours and OpenCV's detector find with a file, before grouping: the same, but that OpenCV leaves out the last row
/// of windows at some scales (the size of its stripes is rounded down).
inline size_t check_equal(const std::filesystem::path& file, const cv::Mat1b& image, double factor) {
  const Cascade cascade = read_cascade(file);
  Search search(image.cols, image.rows, factor, {&cascade, 1});
  cv::CascadeClassifier theirs;
  REQUIRE(theirs.load(file.string()));
  std::vector<cv::Rect> boxes;
  theirs.detectMultiScale(image, boxes, factor, 0);
  std::vector<Box> ours = detect_multi_scale(search, 0, view(image));
  const auto all = sorted(ours), wanted = sorted(boxes);
  std::erase_if(ours, [&](const Box& b) {
    const double scale = static_cast<double>(b.width) / cascade.width;
    return b.y + b.height > image.rows - 1 - (scale < 2 ? 2 : 1) * scale;
  });
  const auto above_the_last = sorted(ours);
  CHECK(std::includes(all.begin(), all.end(), wanted.begin(), wanted.end()));
  CHECK(std::includes(wanted.begin(), wanted.end(), above_the_last.begin(), above_the_last.end()));
  return above_the_last.size();
}

}  // namespace takt::test
