// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <random>

#include "nodes/traffic_signs/reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/traffic_signs/as_opencv.hpp"
#include "tests/property_scale.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/traffic_signs/random_cascade.hpp"

using namespace takt;
using namespace takt::traffic_signs;
using namespace takt::test;

namespace {

/// Blobs of several sizes, with places so flat that no window may be looked at.
cv::Mat1b random_image(uint64_t seed, int width, int height) {
  cv::RNG random(seed + 1000);
  cv::Mat1f image(height, width, 128.0f);
  for (int pitch = 4; pitch <= 32; pitch *= 2) {
    cv::Mat1f coarse(height / pitch + 2, width / pitch + 2), octave;
    random.fill(coarse, cv::RNG::NORMAL, 0, 30);
    cv::resize(coarse, octave, image.size(), 0, 0, cv::INTER_CUBIC);
    image += octave;
  }
  cv::Mat1b bytes;
  image.convertTo(bytes, CV_8U);
  bytes(cv::Rect(width / 2, height / 2, width / 3, height / 3)) = 90;
  return bytes;
}

}  // namespace

TEST_CASE("traffic_signs: a level is what cv::resize and cv::integral make of the image") {
  for (const cv::Size size : {cv::Size(160, 121), cv::Size(97, 64), cv::Size(333, 250)}) {
    const cv::Mat1b image = random_image(static_cast<uint32_t>(size.width), size.width, size.height);
    Pyramid pyramid(size.width, size.height, 1.17, scales(size.width, size.height, 1.17, 12, 12));
    REQUIRE(pyramid.levels() > 5);
    for (int i = 0; i < pyramid.levels(); ++i) {
      pyramid.build(i, view(image));
      const Level& level = pyramid.level(i);
      cv::Mat scaled, sums, squares;
      cv::resize(image, scaled, {level.width, level.height}, 0, 0, cv::INTER_LINEAR_EXACT);
      cv::integral(scaled, sums, squares, CV_32S, CV_64F);
      int wrong = 0;
      for (int y = 0; y <= level.height; ++y)
        for (int x = 0; x <= level.width; ++x) {
          if (x < level.width && y < level.height) wrong += level.grey().at(x, y) != scaled.at<uint8_t>(y, x);
          const auto square = static_cast<uint32_t>(static_cast<uint64_t>(squares.at<double>(y, x)));
          wrong += level.sums()[level.at(x, y)] != sums.at<int>(y, x);
          wrong += static_cast<uint32_t>(level.squares()[level.at(x, y)]) != square;
        }
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("traffic_signs: every window passes as many stages as in the obvious form, with every SIMD target") {
  for (uint32_t k = 1; k <= test::rounds(6u); ++k) {
    const auto seed = static_cast<uint32_t>(test::seed(k));
    const Cascade cascade = test::random_cascade(seed, 9 + static_cast<int>(k), 20 - static_cast<int>(k), 6);
    const cv::Mat1b image = random_image(seed, 90, 70);
    Search search(90, 70, 1.4, {&cascade, 1});
    for (int index = 0; index < search.levels(0); ++index) {
      search.build(index, view(image));
      const Level& level = search.level(index);
      const int columns = search.columns(0, index), rows = search.rows(0, index);
      const auto size = static_cast<size_t>(columns) * static_cast<size_t>(rows);
      std::vector<int> wanted(size);
      std::vector<uint8_t> asked(size);
      for (size_t i = 0; i < size; ++i) {
        const auto column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
        wanted[i] = stages_passed(cascade, level.grey(), column * level.step, row * level.step);
        asked[i] = i * 2654435761u >> 7 & 1;
      }
      on_each_target([&] {
        for (const bool all : {true, false}) {
          std::vector<uint8_t> passed(static_cast<size_t>(columns));
          int wrong = 0;
          for (int row = 0; row < rows; ++row) {
            const size_t first = static_cast<size_t>(row) * static_cast<size_t>(columns);
            const std::span<const uint8_t> of_row(asked.data() + first, static_cast<size_t>(columns));
            search.row(0, index, row, all ? std::span<const uint8_t>() : of_row, passed);
            for (size_t i = 0; i < passed.size(); ++i) {
              const int expected = wanted[first + i] < 0 ? kFlat : wanted[first + i];
              wrong += passed[i] != (all || of_row[i] != 0 ? expected : kNotSearched);
            }
          }
          CHECK(wrong == 0);
        }
      });
    }
  }
}

TEST_CASE("traffic_signs: the windows that pass are those of cv::CascadeClassifier") {
  const test::TemporaryFolder folder;
  size_t found = 0;
  for (uint32_t k = 1; k <= test::rounds(12u); ++k) {
    const auto seed = static_cast<uint32_t>(test::seed(k));
    const auto file = folder.path / (std::to_string(k) + ".xml");
    write_cascade(test::random_cascade(seed, 24, 12 + static_cast<int>(k), 4), file, "for a test");
    found += check_equal(file, random_image(seed, 301, 220), 1.1 + 0.03 * k);
  }
  if (test::property_scale() >= 1) CHECK(found > 500);  // a random cascade may let nothing pass, so may the first few
}

TEST_CASE("traffic_signs: groups are those of cv::groupRectangles") {
  std::mt19937 random(test::seed(3));
  const auto in = [&](int low, int high) {
    return low + static_cast<int>(random() % static_cast<uint32_t>(high - low + 1));
  };
  Grouping grouping(300);
  for (int round = 0; round < test::rounds(200); ++round) {
    std::vector<Box> boxes;
    std::vector<cv::Rect> theirs;
    for (int cluster = in(1, 12); cluster > 0; --cluster) {
      const int x = in(0, 200), y = in(0, 200), side = in(20, 90);
      for (int k = in(1, 12); k > 0; --k) {
        boxes.push_back({x + in(-6, 6), y + in(-6, 6), side + in(-6, 6), side + in(-6, 6)});
        const Box& b = boxes.back();
        theirs.emplace_back(b.x, b.y, b.width, b.height);
      }
    }
    const int least = in(2, 5);
    cv::groupRectangles(theirs, least - 1, 0.2);
    std::vector<Box> ours;
    for (const Group& group : grouping.group(boxes, least)) ours.push_back(group.box);
    CHECK(sorted(ours) == sorted(theirs));
  }
}
