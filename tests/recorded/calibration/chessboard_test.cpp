// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "nodes/calibration/calibrate.hpp"
#include "nodes/calibration/epipolar.hpp"
#include "tests/recorded/recording.hpp"
#include "tests/unit/calibration/chessboard_views.hpp"

using namespace takt;
using namespace takt::calibration;
using takt::test::recording;

TEST_CASE("the recorded chessboard gives rows better than half a pixel") {
  const auto folder = recording("calibration/chessboard_stereo");
  const Board board;
  const auto images = read_pairs(find_pairs(folder, "left*.jpg", "right*.jpg"));
  std::vector<View> views = takt::test::views_of(images, board);
  std::erase_if(views, [](const View& view) { return view.left.empty() || view.right.empty(); });
  REQUIRE(views.size() >= 10);
  const CalibrationResult result = calibrate(views, board, images.front().left.size());
  CHECK(result.fit.both_px < 0.5);
  stereo::Rectifier rectifier(result.fit.cameras);
  std::vector<RectifiedPair> rectified;
  for (const GreyPair& pair : images) rectified.push_back(rectify(rectifier, pair, board));
  const auto rows = epipolar_error(rectified);
  REQUIRE(rows);
  CHECK(rows->median_px < 0.5);
}
