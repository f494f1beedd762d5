// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nodes/person_tracking/shirt_place.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/odometry.hpp"

using namespace takt;
using namespace takt::person_tracking;

namespace {

ImageView<const uint8_t> view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, image.channels()};
}

/// A flat board of 7 x 8 squares, seen under a rotation, on noise.
cv::Mat board_image(double square_px, double angle, double light, uint64_t seed) {
  cv::Mat image(480, 640, CV_8UC1), noise(480, 640, CV_16SC1);
  const double c = std::cos(angle), s = std::sin(angle);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      int sum = 0;
      for (const double dx : {-0.25, 0.25})
        for (const double dy : {-0.25, 0.25}) {
          const double u = (c * (x + dx - 300) + s * (y + dy - 250)) / square_px,
                       v = (c * (y + dy - 250) - s * (x + dx - 300)) / square_px;
          const bool on = std::abs(u) < 3.5 && std::abs(v) < 4;
          sum += !on                                                                                      ? 190
                 : (static_cast<int>(std::floor(u + 3.5)) + static_cast<int>(std::floor(v + 4))) % 2 == 0 ? 30
                                                                                                          : 190;
        }
      image.at<uint8_t>(y, x) = static_cast<uint8_t>(light * sum / 4);
    }
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::NORMAL, 0, 3);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
  return image;
}

const Region kAll{0, 0, 640, 480};

}  // namespace

TEST_CASE("a saddle has the largest response, edges, lines and corners of one square have none") {
  const auto response = [](auto&& level) {
    std::vector<uint8_t> pixels(81);
    for (int i = 0; i < 81; ++i) pixels[static_cast<size_t>(i)] = static_cast<uint8_t>(level(i % 9 - 4, i / 9 - 4));
    return saddle_response({pixels.data(), 9, 9}, 4, 4);
  };
  CHECK(response([](int x, int y) { return x * y > 0 ? 255 : x * y < 0 ? 0 : 128; }) > 1000);
  CHECK(response([](int, int) { return 77; }) == 0);
  CHECK(response([](int x, int) { return x < 0 ? 0 : 255; }) == 0);
  CHECK(response([](int x, int) { return x == 0 ? 255 : 0; }) == 0);
  CHECK(response([](int x, int y) { return x > 0 && y > 0 ? 255 : 0; }) == 0);
  CHECK(response([](int x, int y) { return x == 0 || y == 0 ? 255 : 0; }) == 0);  // the frames of windows
}

TEST_CASE("a board is found at every size, angle and light, with its corners, its square and its box") {
  ChessboardFinder finder(640, 480, 1, {});
  uint64_t seed = 0;
  for (const double square : {4.5, 6.0, 9.0, 14.0, 22.0, 32.0})
    for (const double angle : {0.0, 0.2, -0.4})
      for (const double light : {0.4, 1.0}) {
        CAPTURE(square);
        CAPTURE(angle);
        CAPTURE(light);
        const cv::Mat image = board_image(square, angle, light, ++seed);
        const auto boards = finder.find(view_of(image), kAll, ChessboardFinder::level_for(square));
        REQUIRE(boards.size() >= 1);
        CHECK(boards[0].corners >= 36);  // of 42
        CHECK(boards[0].corners <= 44);
        CHECK(boards[0].square_px == doctest::Approx(square).epsilon(0.06));
        CHECK(boards[0].box.x + boards[0].box.width / 2 == doctest::Approx(300).epsilon(0.02));
        CHECK(boards[0].box.y + boards[0].box.height / 2 == doctest::Approx(250).epsilon(0.02));
      }
}

TEST_CASE("what is no chessboard is none: noise, windows, stripes, plaid, one square") {
  ChessboardFinder finder(640, 480, 1, {});
  cv::Mat image(480, 640, CV_8UC1);
  const auto none = [&](auto&& level) {
    cv::RNG random(5);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        image.at<uint8_t>(y, x) =
            static_cast<uint8_t>(std::clamp(level(x, y) + static_cast<int>(random.gaussian(3)), 0, 255));
    for (int l = 0; l < ChessboardFinder::kLevels; ++l) CHECK(finder.find(view_of(image), kAll, l).empty());
  };
  std::mt19937 random(9);
  none([&](int, int) { return static_cast<int>(random() % 256); });
  none([](int x, int y) { return x % 16 < 12 && y % 20 < 16 ? 190 : 40; });
  none([](int, int y) { return y % 16 < 8 ? 190 : 40; });
  none([](int x, int y) { return 40 + (x % 16 < 8 ? 70 : 0) + (y % 16 < 8 ? 70 : 0); });
  none([](int x, int y) { return x > 300 && y > 200 && x < 320 && y < 220 ? 190 : 40; });
}

TEST_CASE("finding allocates nothing, and looks only where it is told") {
  ChessboardFinder finder(640, 480, 1, {});
  const cv::Mat image = board_image(9, 0.1, 1, 1);
  const uint64_t before = thread_memory_use().allocations;
  const size_t all = finder.find(view_of(image), kAll, 0).size();
  const size_t beside = finder.find(view_of(image), {400, 0, 300, 500}, 0).size();
  const size_t outside = finder.find(view_of(image), {700, 10, 50, 50}, 1).size();
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK(all == 1);
  CHECK(beside == 0);
  CHECK(outside == 0);
}

TEST_CASE("the range comes from disparities that agree with the size of the squares, else from that size") {
  const CameraModel camera{492.8, 319.5, 239.5, 0.24};
  const ShirtParameters p;
  Board board;
  board.box = {280, 180, 80, 100};
  board.square_px = 492.8 * 0.06 / 3;  // at 3 m
  for (board.corners = 0; board.corners < 12; ++board.corners)
    board.places[static_cast<size_t>(board.corners)] = {300.0f + static_cast<float>(board.corners), 220.0f};
  std::vector<int16_t> disparity(640 * 480, 39);
  const Disparities known{{disparity.data(), 640, 480}};
  const auto is = [&](const Disparities& disparities, double z_m, bool by_disparity, bool sure) {
    const BoardRange range = measure_range(board, disparities, camera, p);
    CHECK(range.z_m == doctest::Approx(z_m));
    CHECK(range.by_disparity == by_disparity);
    CHECK(range.sure == sure);
  };
  is(known, 492.8 * 0.24 / 39, true, true);
  is({}, 3, false, true);
  std::fill(disparity.begin(), disparity.end(), int16_t{59});  // two squares off: the pattern repeats
  is(known, 3, false, false);
  std::fill(disparity.begin(), disparity.end(), int16_t{-1});
  is(known, 3, false, false);
}

TEST_CASE("where a board is, there it is expected again; chequered floors are no shirts") {
  const Viewpoint view{{492.8, 319.5, 239.5, 0.24},
                       mapping_3d::to_affine(mapping_3d::camera_mount(-0.12, 0.15, 1.4, 0, -0.26)),
                       mapping_3d::to_affine(mapping_3d::robot_in_odometry({3, 2, 0.7, 0, 0}))};
  ShirtParameters p;
  p.behind_m = 0;
  Board board;
  board.box = {400, 150, 80, 100};
  const auto place = place_of(board, {3, 0.1, true, true}, view, p);
  REQUIRE(place);
  const auto expected = expected_board(place->at, height_of(board, 3, view), 8, 10, view, p);
  REQUIRE(expected);
  CHECK(expected->x_px == doctest::Approx(440));
  CHECK(expected->y_px == doctest::Approx(200));
  CHECK(expected->square_px == doctest::Approx(492.8 * 0.06 / 3));
  CHECK(place->covariance.trace() == doctest::Approx(0.1 * 0.1 + 0.06 * 0.06 + std::pow(3 * 4 / 492.8, 2)));
  board.box.y = 400;
  CHECK_FALSE(place_of(board, {3, 0.1, true, true}, view, p));
  CHECK_FALSE(
      expected_board(Eigen::Vector2d(3, 2) - 3 * Eigen::Vector2d(std::cos(0.7), std::sin(0.7)), 1.2, 8, 10, view, p));
}
