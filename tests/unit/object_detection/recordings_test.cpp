// SPDX-License-Identifier: Apache-2.0
// Photographs of real objects (COIL-100, thesis Sec. 3.4 works with such views) in generated scenes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "nodes/object_detection/evaluate.hpp"
#include "tests/test_data.hpp"

using namespace takt::object_detection;

namespace {

/// The object of a photograph on black, at 48 x 48. What is nearly black there is background.
ReferenceView cut_out(const std::filesystem::path& file) {
  cv::Mat3f colours;
  cv::imread(file.string(), cv::IMREAD_COLOR).convertTo(colours, CV_32FC3);
  cv::Mat1f mask(colours.size());
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      cv::Vec3f& c = colours(y, x);
      mask(y, x) = std::max({c[0], c[1], c[2]}) > 12 ? 1.0f : 0.0f;
      c *= mask(y, x);
    }
  cv::resize(colours, colours, {48, 48}, 0, 0, cv::INTER_AREA);
  cv::resize(mask, mask, {48, 48}, 0, 0, cv::INTER_AREA);
  ReferenceView view;
  view.file = file;
  view.side_px = 48;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x)
      for (int c = 0; c < 3; ++c)
        view.pixels.push_back(
            mask(y, x) > 0.5f ? static_cast<uint8_t>(std::clamp(std::lround(colours(y, x)[c] / mask(y, x)), 1l, 255l))
                              : uint8_t{0});
  return view;
}

/// Every 60 degrees a reference, in between a view for the test.
std::vector<DatabaseObject> coil(const std::filesystem::path& folder) {
  std::set<int> numbers;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    int number = 0, angle = 0;
    if (std::sscanf(entry.path().filename().c_str(), "obj%d__%d.png", &number, &angle) == 2) numbers.insert(number);
  }
  std::vector<DatabaseObject> objects;
  for (const int number : numbers) {
    DatabaseObject& object = objects.emplace_back();
    object.name = "obj" + std::to_string(number);
    for (int angle = 0; angle < 360; angle += 30) {
      const auto file = folder / (object.name + "__" + std::to_string(angle) + ".png");
      if (!std::filesystem::exists(file)) continue;
      (angle % 60 == 0 ? object.views : object.test_views).push_back(cut_out(file));
    }
  }
  return objects;
}

}  // namespace

TEST_CASE("photographed objects, views 60 degrees apart: most windows go, few objects with them") {
  const auto folder = takt::test::recording("objects/coil100");
  if (!folder) return;
  const auto database = coil(*folder);
  REQUIRE(database.size() == 10);
  Exclusion of[2];
  for (const ColourBins bins : {ColourBins::hsv_64x32x2, ColourBins::hsv_64x64x1}) {
    DetectorParameters p;
    p.bins = bins;
    Detector detector(640, 480, database, p);
    ColourStageTest test(detector);
    Measurement m;
    for (uint64_t i = 0; i < 60; ++i)
      measure(make_scene(database, {}, 1, i), detector.grid(), database.size(), test, m);
    of[static_cast<size_t>(bins)] = m.at(1);
    MESSAGE((bins == ColourBins::hsv_64x32x2 ? "64x32x2: " : "64x64x1: ")
            << m.object_factor.size() << " objects: missed " << m.at(1).missed_pct << " %, excluded "
            << m.at(1).excluded_pct << " %; none missed: excluded " << m.at(m.no_miss_factor()).excluded_pct << " %");
  }
  CHECK(of[1].excluded_pct >= 75);
  CHECK(of[1].missed_pct < 10);
  CHECK(of[1].missed_pct <= of[0].missed_pct);  // why bins without value are the default
}
